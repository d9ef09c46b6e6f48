"""A real Slurm on this machine, in a folder of its own: Debian's packages, unpacked, on loopback.

Nothing is installed. It needs root rights (slurmd starts jobs as their owners) and a Debian mirror.
"""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from needed import lacking

PACKAGES = (
    "slurmctld", "slurmd", "slurm-client", "slurm-wlm-basic-plugins", "munge", "libmunge2",
    "libhwloc15", "liblua5.1-0", "libnuma1",
)  # fmt: skip

CONFIGURATION = """ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/none
CredType=cred/none
PluginDir={libraries}
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/ctld.pid
SlurmdPidFile={folder}/d.pid
SlurmctldLogFile={folder}/log/ctld.log
SlurmdLogFile={folder}/log/d.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
SchedulerParameters=batch_sched_delay=0,sched_interval=2,bf_interval=2
ReturnToService=2
JobRequeue=1
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory=2000 State=UNKNOWN
PartitionName=debug Nodes=ALL Default=YES MaxTime=INFINITE State=UP OverSubscribe=NO
"""


@contextmanager
def slurm(folder: Path) -> Iterator[dict[str, str]]:
    """Run Slurm; gives the environment in which its commands are found.

    Args:
        folder: Of all that it needs and writes; it exists.
    """
    root = _unpacked(folder)
    libraries = root / "usr/lib/x86_64-linux-gnu/slurm-wlm"
    host = socket.gethostname()
    for name in ("state", "spool", "log", "bin"):
        (folder / name).mkdir()
    text = CONFIGURATION.format(folder=folder, libraries=libraries, host=host, ports=_ports())
    (folder / "slurm.conf").write_text(text, encoding="utf-8")
    env = {
        **os.environ,
        "SLURM_CONF": str(folder / "slurm.conf"),
        "LD_LIBRARY_PATH": f"{libraries}:{libraries.parent}",
        "PATH": f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}",
    }
    for name in ("sbatch", "squeue", "scancel", "scontrol", "sinfo"):
        (folder / "bin" / name).symlink_to(root / "usr/bin" / name)
    daemons = [
        [root / "usr/sbin/slurmctld-wlm", "-D"],
        [root / "usr/sbin/slurmd-wlm", "-D", "-d", root / "usr/sbin/slurmstepd-wlm"],
    ]
    running = []
    try:
        for number, words in enumerate(daemons):
            log = (folder / "log" / f"{number}.txt").open("wb")
            running.append(
                subprocess.Popen(
                    [str(word) for word in words], env=env, stdout=log, stderr=log,
                    stdin=subprocess.DEVNULL,
                )
            )  # fmt: skip
            log.close()
        _wait(env, folder)
        yield env
    finally:
        subprocess.run(["scancel", "--user=root"], env=env, capture_output=True, check=False)
        for process in reversed(running):
            process.terminate()
            process.wait()


def _unpacked(folder: Path) -> Path:
    """Download and unpack the packages; without them a test is skipped, and CI fails."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0:
        lacking("Slurm starts jobs as their owners: it needs root rights")
    if not (shutil.which("apt-get") and shutil.which("dpkg")) or os.uname().machine != "x86_64":
        lacking("Slurm is taken from Debian's packages for x86-64")
    debs = folder / "debs"
    debs.mkdir()
    for again in (False, True):
        if again:
            subprocess.run(["apt-get", "update", "-qq"], capture_output=True, check=False)
        done = subprocess.run(
            ["apt-get", "download", "-q", *PACKAGES], cwd=debs, capture_output=True, check=False
        )
        if done.returncode == 0:
            break
    else:
        lacking("no Debian mirror has Slurm's packages")
    root = folder / "root"
    for deb in debs.glob("*.deb"):
        subprocess.run(["dpkg", "-x", str(deb), str(root)], check=True)
    return root


def _ports() -> list[int]:
    """Free ports of this machine."""
    sockets = [socket.socket() for _ in range(2)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    found = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return found


def _wait(env: dict[str, str], folder: Path) -> None:
    """Wait until the node takes jobs."""
    said = ""
    for _ in range(120):
        done = subprocess.run(
            ["sinfo", "--noheader", "--format=%T"],
            env=env, capture_output=True, text=True, check=False,
        )  # fmt: skip
        said = done.stdout.strip() or done.stderr.strip()
        if said == "idle":
            return
        time.sleep(0.5)
    logs = "".join(p.read_text("utf-8", "replace")[-1500:] for p in (folder / "log").iterdir())
    raise AssertionError(f"Slurm does not come up: {said}\n{logs}")
