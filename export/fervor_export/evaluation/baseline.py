"""The paper's baseline: a support vector machine on handcrafted features, its settings searched for inside each fold.

The search sees the training clips alone, in inner folds that part actors, so it can't learn who is judged. Features
are scaled inside the pipeline, by the clips that each fit learns from.
"""

import warnings
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
from sklearn.exceptions import ConvergenceWarning
from sklearn.model_selection import GridSearchCV, GroupKFold
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVR

from fervor.emotions import EMOTIONS, emotion_index
from fervor_export.clip import Clip

Floats = npt.NDArray[np.float64]
Grid = Mapping[str, Sequence[float | str]]

GRID: Grid = {
    "svr__C": (0.1, 1.0, 10.0, 100.0),
    "svr__gamma": ("scale", 1e-3, 1e-2, 1e-1),
    "svr__epsilon": (0.01, 0.05, 0.1),
}
"""Settings tried."""

INNER_FOLDS = 3

MOST_ITERATIONS = 200_000
"""Of the solver, in one fit: the largest C on data that can't be fitted would never end."""


def fit(
    handcrafted: Floats,
    clips: Sequence[Clip],
    *,
    with_emotion: bool = True,
    grid: Grid = GRID,
) -> Pipeline:
    """The baseline, fitted to clips and their features [clip, feature].

    Args:
        handcrafted: `handcrafted.matrix` of the clips.
        clips: what to learn from.
        with_emotion: whether it is told the emotion, as the network is.
        grid: settings to try; chosen by mean squared error over inner folds that part actors, or recordings where
            there is one actor only.
    """
    pipeline = make_pipeline(StandardScaler(), SVR(kernel="rbf", cache_size=400, max_iter=MOST_ITERATIONS))
    inputs, target = _inputs(handcrafted, clips, with_emotion=with_emotion), [clip.intensity for clip in clips]
    groups = [clip.actor for clip in clips]
    if len(set(groups)) < 2:
        groups = [clip.name for clip in clips]
    folds = min(INNER_FOLDS, len(set(groups)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # such settings lose the search
        if folds < 2:
            return pipeline.fit(inputs, target)
        search = GridSearchCV(pipeline, dict(grid), scoring="neg_mean_squared_error", cv=GroupKFold(folds))
        fitted: Pipeline = search.fit(inputs, target, groups=groups).best_estimator_
    return fitted


def predict(pipeline: Pipeline, handcrafted: Floats, clips: Sequence[Clip], *, with_emotion: bool = True) -> Floats:
    """Intensities [clip], kept within 0 and 1."""
    predicted = pipeline.predict(_inputs(handcrafted, clips, with_emotion=with_emotion))
    return np.clip(np.asarray(predicted, np.float64), 0.0, 1.0)


def _inputs(handcrafted: Floats, clips: Sequence[Clip], *, with_emotion: bool) -> Floats:
    """Features, and the emotion as one of eleven columns."""
    if not with_emotion:
        return handcrafted
    emotion = np.eye(len(EMOTIONS))[[emotion_index(clip.emotion) for clip in clips]]
    return np.concatenate([handcrafted, emotion], axis=1)
