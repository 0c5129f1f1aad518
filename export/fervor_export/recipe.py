"""How a network is trained: the paper's recipe, and the default, whose every difference has its reason beside it.

What each choice was found to be worth: docs/reference/ablation.md, written by `fervor ablate`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from fervor_export.features import FeatureSet
from fervor_export.network import HeadKind


@dataclass(frozen=True, slots=True)
class Recipe:
    """Every choice of a training run; rates are probabilities per sequence, times in seconds."""

    name: str
    features: FeatureSet
    head: HeadKind
    optimizer: Literal["rmsprop", "adamw"]
    learning_rate: float
    epochs: int
    batch_size: int
    loss_at: Literal["last", "frames"]
    """The last frame's intensity only, or that of every frame from `settle_s` on."""
    mirror: bool = False
    """Whether every clip is learned from as its mirror image too."""
    phases: int = 1
    """How many 30 Hz phases of a fast recording are learned from, at most."""
    keep: Literal["best", "last"] = "best"
    """Which epoch's weights: the best on actors kept for it, or the last, and then nobody has to be kept."""
    standardise: bool = False
    """Whether features go in at mean 0 and deviation 1; folded into the weights at the end."""
    weight_decay: float = 0.0
    ccc_weight: float = 0.0
    """Share of 1 - CCC in the loss; the rest is the mean absolute error."""
    settle_s: float = 0.0
    """Time at the start of a clip in which nothing is expected of the estimates."""
    unknown_share: float = 0.0
    """Share of the loss that is taken with the emotion left out, so that E = 0 means something."""
    clip_gradient: float | None = None
    anneal: bool = False
    """Whether the learning rate falls to zero along a half cosine."""
    crop: float = 0.0
    """How often a clip begins somewhere inside itself."""
    join: float = 0.0
    """How often another clip follows in the same stream, and then another."""
    longest_s: float = 30.0
    """Longer streams are cut."""
    joint_dropout: float = 0.0
    """How often each joint is lost for the whole stream."""
    leg_dropout: float = 0.0
    wrist_dropout: float = 0.0
    trunk_dropout: float = 0.0
    """How often both legs, both wrists, or spine and chest are lost: sensors differ in what they see."""
    bind_noise_deg: float = 0.0
    """Standard deviation of a constant turn of each joint: sensors differ in where they mount their axes."""
    patience: int | None = None
    """Epochs without a better validation error after which training ends; where `keep` is "best"."""

    @property
    def steady(self) -> bool:
        """Whether a clip is the same in every epoch, so that its features need to be computed only once."""
        chances = (self.crop, self.join, self.joint_dropout, self.leg_dropout, self.wrist_dropout, self.trunk_dropout)
        return not any((*chances, self.bind_noise_deg))


PAPER = Recipe(
    name="paper",
    features="euler",
    head="additive",
    optimizer="rmsprop",
    learning_rate=1e-3,  # Keras' default, as the paper names none
    epochs=100,
    batch_size=256,
    loss_at="last",
    mirror=True,
    phases=4,
    keep="last",  # the paper names neither validation actors nor early stopping
)
"""Sun et al., section IV-B, to the letter."""

DEFAULT = Recipe(
    name="default",
    features="rot6d+velocity",  # no jumps at ±π, and speed is in plain sight
    standardise=True,  # r within emotion 0.31 instead of 0.21 after four epochs, one seed
    head="gated",  # each emotion reads the descriptor its own way
    optimizer="adamw",
    learning_rate=4e-3,
    # With 1e-2 (9000 clips, 10 epochs, seed 0) rounding grew until torch and onnxruntime differed by 4.5e-5, and the
    # model file was refused; r within emotion is about the same (validation 0.500 instead of 0.507).
    weight_decay=5e-2,
    epochs=14,  # of many clips: more clips do more than more epochs
    batch_size=64,
    loss_at="frames",  # a live body is asked at every frame, not at a clip's end
    settle_s=1.0,  # the service says `warming_up` as long
    ccc_weight=0.3,  # the absolute error alone shrinks estimates towards the middle
    unknown_share=0.2,  # a robot may not have a label yet
    clip_gradient=1.0,
    anneal=True,
    crop=0.3,  # a live stream begins anywhere
    join=0.25,  # and goes on
    longest_s=14.0,  # beyond the 8 s after which the service restarts a state
    joint_dropout=0.02,
    leg_dropout=0.15,  # seated people, tables
    wrist_dropout=0.05,
    trunk_dropout=0.05,
    bind_noise_deg=4.0,
    patience=6,
)
"""Trained to be asked at every frame of a long stream from any sensor."""

RECIPES: Mapping[str, Recipe] = MappingProxyType({recipe.name: recipe for recipe in (DEFAULT, PAPER)})
