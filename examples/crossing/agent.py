"""Teach a traffic light of the city example, and film what it does in the end.

    pip install ".[sumo]" gymnasium
    python -m examples.crossing.agent --folder learnt --episodes 20

The environment is gymnasium's, so any learning library can take the place of the small table
that learns here.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import gymnasium
import libsumo
import numpy as np

import sumo3dviz_pt as sv

HERE = Path(__file__).resolve().parent
LIGHT, ARMS = "C", ("N", "E", "S", "W")
GREENS = (0, 3, 6, 9)
"""Phases that may last; the others clear the junction and keep their time."""

DECIDE, LEAST, MOST = 5, 10, 60
"""Seconds between decisions, and how long a green lasts at least and at most."""

OPTIONS = ("--lanechange.duration=3", "--time-to-teleport=-1", "--no-step-log", "--no-warnings")
"""As in the example's own configuration."""

QUEUES = (2, 6)
"""Numbers of waiting road users that divide none, some and many."""


class TrafficLight(gymnasium.Env):
    """One light: 0 keeps the green, 1 ends it. People and drivers who wait cost.

    Args:
        end: The last second.
        recording: A folder for what happens; without one nothing is recorded.
    """

    def __init__(self, *, end: int = 540, recording: Path | None = None) -> None:
        self.action_space = gymnasium.spaces.Discrete(2)
        shares = np.array([len(GREENS), *(len(QUEUES) + 1 for _ in ARMS)])
        self.observation_space = gymnasium.spaces.MultiDiscrete(shares)
        self.end, self.recording = end, recording
        self.recorder: sv.Recorder | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start the day anew; `seed` is SUMO's."""
        super().reset(seed=seed, options=options)
        self.close()
        # The example's own configuration would write over its logs.
        files = {"-n": "crossing.net.xml.gz", "-r": "crossing.rou.xml", "-a": "stops.add.xml"}
        inputs = [word for key, name in files.items() for word in (key, str(HERE / name))]
        libsumo.start(["sumo", *inputs, *OPTIONS, "--seed", str(4 if seed is None else seed)])
        if self.recording:
            self.recorder = sv.Recorder(libsumo, self.recording, overwrite=True)
        return self.seen(), {}

    def step(self, action: int) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Decide, and see what the next seconds bring."""
        if action or libsumo.trafficlight.getSpentDuration(LIGHT) >= MOST:
            libsumo.trafficlight.setPhaseDuration(LIGHT, 0)
        else:
            libsumo.trafficlight.setPhaseDuration(LIGHT, DECIDE)
        waited = 0.0
        for _ in range(LEAST if action else DECIDE):
            waited += self.second()
        while libsumo.trafficlight.getPhase(LIGHT) not in GREENS:
            waited += self.second()
        over = libsumo.simulation.getTime() >= self.end
        return self.seen(), -waited, False, over, {}

    def second(self) -> int:
        """Let a second pass; return how many waited in it."""
        libsumo.simulationStep()
        if self.recorder:
            self.recorder.step()
        return sum(libsumo.edge.getLastStepHaltingNumber(f"{arm}_in") for arm in ARMS)

    def seen(self) -> np.ndarray:
        """Which green, and how long the queues are."""
        queues = [libsumo.edge.getLastStepHaltingNumber(f"{arm}_in") for arm in ARMS]
        phase = GREENS.index(libsumo.trafficlight.getPhase(LIGHT))
        return np.array([phase, *np.digitize(queues, QUEUES)])

    def close(self) -> None:
        """End the simulation and the recording."""
        if self.recorder:
            self.recorder.close()
            self.recorder = None
        if libsumo.isLoaded():
            libsumo.close()


def learn(light: TrafficLight, episodes: int, seed: int = 1) -> np.ndarray:
    """Return the worth of both actions in every state, by Q-learning."""
    worth = np.zeros((*light.observation_space.nvec, 2))
    draw = np.random.default_rng(seed)
    for episode in range(episodes):
        bold = 0.5 * (1.0 - episode / episodes)
        state, over, total = tuple(light.reset(seed=episode)[0]), False, 0.0
        while not over:
            action = int(draw.random() < 0.3) if draw.random() < bold else worth[state].argmax()
            after, reward, _, over, _ = light.step(int(action))
            told = reward + 0.95 * worth[tuple(after)].max()
            worth[(*state, action)] += 0.2 * (told - worth[(*state, action)])
            state, total = tuple(after), total + reward
        print(f"episode {episode + 1} of {episodes}: {-total:.0f} s waited", flush=True)
    light.close()
    return worth


def film(
    worth: np.ndarray, folder: Path, *, end: int = 540, seconds: float = 10.0, **choices: Any
) -> Path:
    """Let the light decide by what it learnt, and film the last seconds of it.

    Args:
        worth: What `learn` returned.
        folder: For the recording and the film.
        end: The last second of the simulation.
        seconds: Of the film.
        choices: As `Scene.render` takes them.
    """
    light = TrafficLight(end=end, recording=folder)
    state, over = light.reset()[0], False
    while not over:
        state, _, _, over, _ = light.step(int(worth[tuple(state)].argmax()))
    corner = {"mode": "eulerian", "position": [318, 270, 9], "look_at": [300, 300, 1]}
    scene = light.recorder.scene(cameras={"corner": corner})
    light.close()
    path = folder / "learnt.mp4"
    last = end - 5.0
    scene.render(path, camera="corner", start=last - seconds, end=last, overwrite=True, **choices)
    return path


def main() -> None:
    """Learn and film as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folder", type=Path, required=True, help="for recording and film")
    parser.add_argument("--episodes", type=int, default=20, help="to learn from (default: 20)")
    options = parser.parse_args()
    worth = learn(TrafficLight(), options.episodes)
    print(film(worth, options.folder, quality="preview"))


if __name__ == "__main__":
    main()
