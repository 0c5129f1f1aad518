"""What a process used so far, as the kernel counts it (proc(5))."""

import os
from pathlib import Path

TICKS = os.sysconf("SC_CLK_TCK")
"""Clock ticks a second, the unit of processor time in /proc."""


def cpu_seconds(pid: int) -> float:
    """Processor time of a process and its threads, user and system, seconds."""
    after_name = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(after_name[11]) + int(after_name[12])) / TICKS


def family_cpu_seconds(pid: int) -> float:
    """Processor time of a process and of the children that it has now, seconds."""
    return cpu_seconds(pid) + sum(map(cpu_seconds, children(pid)))


def children(pid: int) -> list[int]:
    """The processes that a process has started and that run now."""
    return list(map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="utf-8").split()))


def resident_kib(pid: int) -> int:
    """Resident memory of a process, KiB."""
    for line in Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1])
    return 0


def busy_seconds(processor: int) -> float:
    """Time that a processor was busy since the machine started, whoever used it, stolen time included, seconds."""
    for line in Path("/proc/stat").read_text(encoding="utf-8").splitlines():
        if line.startswith(f"cpu{processor} "):
            user, nice, system, _, _, interrupts, soft_interrupts, stolen, *_ = map(int, line.split()[1:])
            return (user + nice + system + interrupts + soft_interrupts + stolen) / TICKS
    return 0.0
