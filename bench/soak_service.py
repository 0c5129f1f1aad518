"""The service that is soaked: a process of its own, watched through /proc."""

import asyncio
import os
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

OPTIONS = ("--port", "0", "--max-frames-per-second", "1e6", "--max-unsent-bytes", "65536", "--capacity", "256")


@dataclass(frozen=True, slots=True)
class Served:
    """A running service."""

    address: str
    pid: int

    @property
    def url(self) -> str:
        return f"http://{self.address}"

    @property
    def memory(self) -> float:
        """MiB resident."""
        pages = int(Path(f"/proc/{self.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 2**20

    @property
    def descriptors(self) -> int:
        return len(list(Path(f"/proc/{self.pid}/fd").iterdir()))


@asynccontextmanager
async def serve() -> AsyncIterator[Served]:
    """A service, while it is wanted."""
    program = str(Path(sys.executable).with_name("fervor"))
    process = await asyncio.create_subprocess_exec(program, "serve", *OPTIONS, stderr=asyncio.subprocess.PIPE)
    assert process.stderr is not None
    drained = None
    try:
        async for line in process.stderr:
            if b"listening on http://" in line:
                drained = asyncio.create_task(process.stderr.read())
                yield Served(line.decode().rstrip().rpartition("http://")[2], process.pid)
                return
        raise RuntimeError("the service did not start")
    finally:
        if process.returncode is None:
            process.terminate()
        await process.wait()
        if drained is not None:
            await drained
