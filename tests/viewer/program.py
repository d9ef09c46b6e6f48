"""`sumo3dviz-pt view` as a program of its own, as users start it."""

from __future__ import annotations

import queue
import re
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Self

ADDRESS = re.compile(r"http://127\.0\.0\.1:\d+/[\w-]+/")


class Program:
    """A running viewer; ends at the end of `with`.

    Attributes:
        address: Of its page.
        port: It listens on.
    """

    def __init__(self, scene: Path, *options: str, port: int = 0, seconds: float = 240.0) -> None:
        command = [sys.executable, "-u", "-m", "sumo3dviz_pt.cli", "view", str(scene)]
        self._process = subprocess.Popen(
            [*command, "--port", str(port), *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
        )
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._said: list[str] = []
        self._reader = threading.Thread(target=self._listen)
        self._reader.start()
        try:
            self.address = self._announced(time.monotonic() + seconds)
        except BaseException:
            self.kill()
            raise
        self.port = int(self.address.split(":")[2].split("/")[0])

    def _listen(self) -> None:
        """Keep reading, or the program would wait for us."""
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(line)
        self._lines.put(None)

    def _announced(self, deadline: float) -> str:
        """The address that it prints."""
        while True:
            try:
                line = self._lines.get(timeout=max(deadline - time.monotonic(), 0.0))
            except queue.Empty:
                raise AssertionError(f"no address in time; it said: {self._said}") from None
            assert line is not None, f"it ended without an address; it said: {self._said}"
            self._said.append(line)
            if found := ADDRESS.search(line):
                return found.group()

    @property
    def said(self) -> str:
        """All that it has printed so far."""
        while not self._lines.empty():
            self._said.append(self._lines.get() or "")
        return "".join(self._said)

    @property
    def number(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def memory(self) -> float:
        """Resident memory [MiB], on Linux."""
        status = Path(f"/proc/{self._process.pid}/status").read_text(encoding="utf-8")
        return next(int(line.split()[1]) / 1024 for line in status.splitlines() if "VmRSS" in line)

    def stop(self, *, seconds: float = 60.0) -> int:
        """Ask it to end, as Ctrl-C and `kill` do; its exit code."""
        self._process.terminate()
        try:
            self._process.wait(seconds)
        finally:
            self.kill()
        return self._process.returncode

    def kill(self) -> None:
        """End it at once; after its end this does nothing."""
        self._process.kill()
        self._process.wait()
        self._reader.join()
        assert self._process.stdout is not None
        self._process.stdout.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()
