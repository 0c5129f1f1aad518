"""The paper's network: LSTM(64), LSTM(128), one fully connected layer on [D ; E] and a sigmoid (section III-B).

D is the last hidden state, the pose descriptor; E the emotion vector. E enters after the recurrence, so the state does
not depend on it: a label may change at any frame, and one pass gives the intensity under every emotion.

`forward` takes and gives exactly what the model file does. The head has one logit per emotion and one for "unknown";
the intensity for E is the sigmoid of their mixture, weights E and 1 - ΣE. Written out, that is the paper's layer:

    additive   w·D + u·E + b                      one direction of D for all emotions
    gated      w·D + b + Σ_k E_k (v_k·D + u_k)    a direction of D for each emotion
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import torch
from torch import Tensor, nn

from fervor.emotions import EMOTIONS
from fervor.metadata import StateTensor
from fervor.skeletons.rig import JOINTS
from fervor_export.features import FeatureSet, euler, rot6d_velocity, width

HeadKind = Literal["additive", "gated"]


@dataclass(frozen=True, slots=True)
class NetworkConfig:
    """What a network is built from."""

    features: FeatureSet = "rot6d+velocity"
    head: HeadKind = "gated"
    rate_hz: float = 30.0
    hidden1: int = 64
    hidden2: int = 128

    @property
    def states(self) -> tuple[StateTensor, ...]:
        """Names and shapes of the recurrent tensors, batch axis left out."""
        recurrent = (
            StateTensor(name="h1", shape=(self.hidden1,)),
            StateTensor(name="c1", shape=(self.hidden1,)),
            StateTensor(name="h2", shape=(self.hidden2,)),
            StateTensor(name="c2", shape=(self.hidden2,)),
        )
        if self.features == "euler":
            return recurrent
        return (*recurrent, StateTensor(name="previous", shape=(len(JOINTS), 4)))


class NetworkOutput(NamedTuple):
    """One pass over [batch, time] frames."""

    intensity: Tensor  # [batch, time]
    intensity_by_emotion: Tensor  # [batch, time, emotion]
    states: dict[str, Tensor]  # name -> [batch, *shape], after the last frame


class Head(nn.Module):
    """The fully connected layer on [D ; E]: a logit of D for each emotion, and one for unknown."""

    def __init__(self, kind: HeadKind, descriptor: int) -> None:
        super().__init__()
        self.kind = kind
        self.shared = nn.Linear(descriptor, 1)  # w, b
        self.emotion_bias = nn.Parameter(torch.zeros(len(EMOTIONS)))  # u
        self.emotion_weight = nn.Parameter(torch.zeros(len(EMOTIONS), descriptor), requires_grad=kind == "gated")  # v

    def columns(self) -> tuple[Tensor, Tensor]:
        """Weights [12, descriptor] and biases [12] of the logits: the emotions in order, then unknown."""
        weight = torch.cat([self.shared.weight + self.emotion_weight, self.shared.weight])
        bias = torch.cat([self.shared.bias + self.emotion_bias, self.shared.bias])
        return weight, bias

    def set_columns(self, weight: Tensor, bias: Tensor) -> None:
        """The inverse of `columns`, up to rounding."""
        with torch.no_grad():
            self.shared.weight.copy_(weight[-1:])
            self.shared.bias.copy_(bias[-1:])
            self.emotion_weight.copy_(weight[:-1] - weight[-1:])
            self.emotion_bias.copy_(bias[:-1] - bias[-1:])

    def forward(self, descriptor: Tensor) -> Tensor:
        """Logits [..., 12] of descriptors [..., descriptor]."""
        return nn.functional.linear(descriptor, *self.columns())


def mixture(emotion: Tensor) -> Tensor:
    """Weights [..., 12] of the head's logits for emotion vectors [..., 11]: what E leaves of 1 goes to unknown."""
    return torch.cat([emotion, 1.0 - emotion.sum(-1, keepdim=True)], -1)


class Network(nn.Module):
    """Pose sequences and emotion vectors to intensities."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        self.mean: Tensor
        self.scale: Tensor
        self.register_buffer("mean", torch.zeros(width(config.features)))
        self.register_buffer("scale", torch.ones(width(config.features)))
        self.lstm1 = nn.LSTM(width(config.features), config.hidden1, batch_first=True)
        self.lstm2 = nn.LSTM(config.hidden1, config.hidden2, batch_first=True)
        self.head = Head(config.head, config.hidden2)

    def standardise(self, mean: Tensor, deviation: Tensor) -> None:
        """Let the first LSTM see features at mean 0 and deviation 1; both [feature]. Helps training, until `fold`."""
        self.mean.copy_(mean)
        self.scale.copy_(1.0 / deviation)

    def fold(self) -> None:
        """Move the standardisation into the first LSTM's weights; what the network computes stays the same."""
        weight, bias = (self.lstm1.get_parameter(name) for name in ("weight_ih_l0", "bias_ih_l0"))
        with torch.no_grad():
            weight.mul_(self.scale)
            bias.sub_(weight @ self.mean)
            self.mean.zero_()
            self.scale.fill_(1.0)

    def zero_states(self, batch: int) -> dict[str, Tensor]:
        """The states of `batch` bodies at a reset."""
        return {state.name: torch.zeros(batch, *state.shape) for state in self.config.states}

    def features(
        self, rotations: Tensor, mask: Tensor, states: Mapping[str, Tensor]
    ) -> tuple[Tensor, dict[str, Tensor]]:
        """What the first LSTM sees [batch, time, feature], and what becomes of the states that features need."""
        if self.config.features == "euler":
            return euler(rotations, mask), {}
        seen, previous = rot6d_velocity(rotations, mask, states["previous"], rate_hz=self.config.rate_hz)
        return seen, {"previous": previous}

    def logits(
        self, rotations: Tensor, mask: Tensor, states: Mapping[str, Tensor] | None = None
    ) -> tuple[Tensor, dict[str, Tensor]]:
        """Logits [batch, time, 12] per emotion and for unknown, and the next states.

        Args:
            rotations: [batch, time, 13, 4] xyzw.
            mask: [batch, time, 13], 1 observed.
            states: name -> [batch, *shape]; None is a reset.
        """
        before = self.zero_states(len(rotations)) if states is None else states
        seen, after = self.features(rotations, mask, before)
        descriptor, recurrent = self.describe(seen, before)
        return self.head(descriptor), after | recurrent

    def describe(self, seen: Tensor, before: Mapping[str, Tensor]) -> tuple[Tensor, dict[str, Tensor]]:
        """Descriptors [batch, time, descriptor] of features [batch, time, feature], and the next recurrent states."""
        hidden, (h1, c1) = self.lstm1(
            (seen - self.mean) * self.scale, (before["h1"].unsqueeze(0), before["c1"].unsqueeze(0))
        )
        descriptor, (h2, c2) = self.lstm2(hidden, (before["h2"].unsqueeze(0), before["c2"].unsqueeze(0)))
        after = {"h1": h1.squeeze(0), "c1": c1.squeeze(0), "h2": h2.squeeze(0), "c2": c2.squeeze(0)}
        return descriptor, after

    def forward(
        self, rotations: Tensor, mask: Tensor, emotion: Tensor, states: Mapping[str, Tensor] | None = None
    ) -> NetworkOutput:
        """What a model file computes.

        Args:
            rotations: [batch, time, 13, 4] xyzw.
            mask: [batch, time, 13], 1 observed.
            emotion: [batch, time, 11], probabilities; all zero is unknown.
            states: name -> [batch, *shape]; None is a reset.
        """
        logits, after = self.logits(rotations, mask, states)
        intensity = (mixture(emotion) * logits).sum(-1).sigmoid()
        return NetworkOutput(intensity, logits[..., :-1].sigmoid(), after)
