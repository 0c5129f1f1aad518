"""A camera or a video before fervor: poses by MediaPipe, emotion labels from the face, intensities back.

    python watch.py                                 # the first camera
    python watch.py party.mp4 --url ws://127.0.0.1:8080

Writes one line of JSON a picture: its time, what the face shows, and what the service answered. Ctrl-C ends it.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator

import cv2
import mediapipe as mp
import numpy as np
import numpy.typing as npt
from face import FaceAnalyser
from steady_label import SteadyLabel

import fervor_client
from fervor_client import sync

EVERY_S = 0.2
"""Time between two looks at the face: expressions are slower than poses."""

LABEL_TTL_S = 2.0
"""A label that is not renewed for so long is void, should the analyser get stuck."""

LEAST_VISIBILITY = 0.5
"""Visibility from which on a landmark counts as seen."""


def pictures(source: int | str) -> Iterator[tuple[float, npt.NDArray[np.uint8]]]:
    """Time in seconds and picture [row, column, 3] RGB: of a camera by the clock, of a video by its own time."""
    capture = cv2.VideoCapture(source)
    if not capture.isOpened():
        raise SystemExit(f"watch.py: {source!r} can't be opened; expected the number of a camera, or a video file")
    rate = capture.get(cv2.CAP_PROP_FPS) or 30.0
    number = 0
    while True:
        there, picture = capture.read()
        if not there:
            return
        yield time.monotonic() if isinstance(source, int) else number / rate, cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)
        number += 1


def landmarks(pose: mp.solutions.pose.Pose, picture: npt.NDArray[np.uint8]) -> npt.NDArray[np.float64]:
    """World landmarks [33, 3] in metres, NaN where they are not seen."""
    found = pose.process(picture).pose_world_landmarks
    if found is None:
        return np.full((33, 3), np.nan)
    points = np.asarray([(point.x, point.y, point.z, point.visibility) for point in found.landmark])
    return np.where(points[:, 3:] >= LEAST_VISIBILITY, points[:, :3], np.nan)


def watch(source: int | str, url: str) -> None:
    """Stream a source to the service at `url` until it ends."""
    analyse, steady = FaceAnalyser(), SteadyLabel()
    looked = -np.inf
    with (
        mp.solutions.pose.Pose(model_complexity=1) as pose,
        sync.connect(url, skeleton="mediapipe", emotion_ttl_s=LABEL_TTL_S) as session,
    ):
        for t, picture in pictures(source):
            label = None  # the old one holds
            if t - looked >= EVERY_S - 1e-6:
                looked, label = t, steady.update(t, analyse(picture))
            estimate = session.estimate(landmarks(pose, picture), t=t, emotion=label)
            line = {"t": round(t, 3), "label": steady.label, "emotion": estimate.emotion}
            line |= {"intensity": estimate.intensity, "level": estimate.level, "status": estimate.status}
            sys.stdout.write(json.dumps(line) + "\n")
            sys.stdout.flush()


def main() -> None:
    """Read the command line, and watch."""
    parser = argparse.ArgumentParser(description="Emotional intensity of the person before a camera or in a video.")
    parser.add_argument("source", nargs="?", default="0", help="number of a camera, or a video file (default: 0)")
    parser.add_argument("--url", default=fervor_client.DEFAULT_URL, help="where the service is")
    given = parser.parse_args()
    try:
        watch(int(given.source) if given.source.isdigit() else given.source, given.url)
    except fervor_client.FervorError as error:
        raise SystemExit(f"watch.py: {error.message}") from None
    except KeyboardInterrupt:
        raise SystemExit(130) from None


if __name__ == "__main__":
    main()
