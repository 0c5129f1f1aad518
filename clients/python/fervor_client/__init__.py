"""Python client of fervor: send body poses, get emotional intensities back while the person moves.

    import asyncio
    import fervor_client

    async def main():
        async with fervor_client.connect("ws://127.0.0.1:8080", emotion="joy") as session:
            pose = [[0, 0, 0, 1]] * len(session.joints)  # a quaternion a joint: standing still
            estimate = await session.estimate(pose)
            print(f"{estimate.emotion}: {estimate.intensity:.2f}, {estimate.level}")

    asyncio.run(main())

`connect` and `Session` are for asyncio; `fervor_client.sync` has the same names for threads, without the `await`.
A cut is mended by the session itself: it connects again, resumes from the service's checkpoints, sends again what was
under way, and hands out every estimate once.
"""

from fervor.errors import AuthError, FervorError, FrameError, InputError, Overloaded, ProtocolError, Unreachable
from fervor.levels import Level
from fervor.protocol.messages import Estimate, SessionCalibrated, Totals
from fervor.protocol.skeleton_spec import SkeletonSpec
from fervor_client import sync
from fervor_client.address import DEFAULT_URL
from fervor_client.aio import Session, connect
from fervor_client.options import Options
from fervor_client.retrying import Reconnect

__all__ = [
    "DEFAULT_URL",
    "AuthError",
    "Estimate",
    "FervorError",
    "FrameError",
    "InputError",
    "Level",
    "Options",
    "Overloaded",
    "ProtocolError",
    "Reconnect",
    "Session",
    "SessionCalibrated",
    "SkeletonSpec",
    "Totals",
    "Unreachable",
    "connect",
    "sync",
]
