"""What the engine keeps of every body: preallocated arrays, a row ("slot") a body.

All but the recurrent states is one record a slot, so that a batch of them is read, and written back, in one copy each.
A slot's first ticket is `fresh` and clears it, so that releasing costs nothing.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from fervor.emotions import EMOTIONS
from fervor.engine.history import History
from fervor.errors import CheckpointMismatch, Overloaded
from fervor.metadata import ModelMetadata
from fervor.rotations import IDENTITY
from fervor.session.checkpoint import Memory
from fervor.session.lanes import LANES
from fervor.skeletons.positions import no_hinges
from fervor.skeletons.rig import JOINTS

RECORD = np.dtype(
    [
        ("pose", "<f8", (len(JOINTS), 4)),  # [joint, 4] xyzw, the newest pose, holes held
        ("hinges", "<f8", no_hinges().shape),  # [limb, bone, 3] landmark sensors: axes of limbs last bent
        ("jumps", "<i8", (len(JOINTS),)),  # [joint] frames rejected in a row
        ("said", "<f8", (1 + len(EMOTIONS),)),  # intensity, nan: no step yet; then under every emotion
        ("seen", "<i8"),  # upper-body joints observed
        ("observed", "?", (len(JOINTS),)),  # [joint]
    ],
    align=True,
)
"""A body but for its states; little-endian, as checkpoints are."""

_BYTES = np.dtype(f"V{RECORD.itemsize}")
"""Records as bytes: numpy copies those in one go, and structures field by field."""

Records = npt.NDArray[np.void]  # [row] of RECORD


def _empty() -> Records:
    """The record of a body that has not been seen: of no dimensions."""
    record = np.zeros((), RECORD)
    record["pose"], record["said"][0] = IDENTITY, np.nan
    return record


_EMPTY = _empty()


class _Lanes(NamedTuple):
    """One state of all lanes."""

    name: str
    values: npt.NDArray[np.float32]  # [slot · LANES + lane, *shape]
    octets: npt.NDArray[np.void]  # [slot · LANES + lane] the same as bytes, which numpy copies fastest

    @classmethod
    def of(cls, name: str, state: npt.NDArray[np.float32]) -> "_Lanes":
        values = state.reshape(-1, *state.shape[2:])
        return cls(name, values, values.reshape(len(values), -1).view(f"V{values[0].nbytes}")[:, 0])


class Slots:
    """Arrays by slot; slots are claimed and released."""

    def __init__(self, capacity: int, metadata: ModelMetadata) -> None:
        self.capacity = capacity
        records = np.zeros(capacity, RECORD)
        self._records = records.view(_BYTES)  # [slot]
        self._records[:] = _EMPTY.view(_BYTES)
        self.pose: npt.NDArray[np.float64] = records["pose"]  # [slot, joint, 4]
        self.observed: npt.NDArray[np.bool_] = records["observed"]  # [slot, joint]
        self.by_emotion: npt.NDArray[np.float64] = records["said"][:, 1:]  # [slot, emotion]
        self.states = {
            state.name: np.zeros((capacity, LANES, *state.shape), np.float32) for state in metadata.states
        }  # name → [slot, lane, *shape]
        self.lanes: npt.NDArray[np.intp] = np.arange(capacity * LANES).reshape(capacity, LANES)  # [slot, lane] number
        self._lanes = [_Lanes.of(name, state) for name, state in self.states.items()]
        self._kept: dict[str, npt.NDArray[Any]] = {
            "body": records.view(np.uint8).reshape(capacity, -1),
            **{f"state.{name}": state for name, state in self.states.items()},
        }  # all of it by name, as checkpoints have it
        self.histories: dict[int, History] = {}  # slot → its last poses, for bodies with memory `window` only
        self._free = deque(range(capacity))

    @property
    def taken(self) -> int:
        """Slots in use."""
        return self.capacity - len(self._free)

    def claim(self) -> int:
        """A free slot.

        Raises:
            Overloaded: none is left.
        """
        if not self._free:
            raise Overloaded(f"all {self.capacity} bodies this service can hold are in use", retry_after=5.0)
        return self._free.popleft()

    def release(self, slot: int) -> None:
        """Make a slot free again; the least recently used is claimed next."""
        self.histories.pop(slot, None)
        self._free.append(slot)

    def clear(self, slots: Sequence[int]) -> None:
        """Forget what these slots hold; states are zeroed by the lanes that restart."""
        self._records[slots] = _EMPTY.view(_BYTES)
        for slot in slots:
            self.histories.pop(slot, None)

    def read(self, slots: npt.NDArray[np.intp]) -> Records:
        """Copies of the records of these slots [row]."""
        return self._records[slots].view(RECORD)

    def write(self, slots: npt.NDArray[np.intp], records: Records) -> None:
        """Make these slots [row] hold these records [row]."""
        self._records[slots] = records.view(_BYTES)

    def take(self, at: npt.NDArray[np.intp]) -> dict[str, npt.NDArray[np.float32]]:
        """Copies of the states of lanes [row], each by its number in `lanes`: name → [row, *shape]."""
        return {name: values.take(at, axis=0) for name, values, _ in self._lanes}

    def put(self, at: npt.NDArray[np.intp], states: Mapping[str, npt.NDArray[np.float32]]) -> None:
        """Make lanes [row] hold these states, name → [row, *shape], in C order; see `take`."""
        for name, _, octets in self._lanes:
            octets[at] = np.frombuffer(states[name], octets.dtype)

    def recall(self, slot: int) -> Memory:
        """Copies of all that a slot holds."""
        history = self.histories.get(slot)
        window = {} if history is None else {"history": history.rotations, "history_mask": history.mask}
        return Memory({name: array[slot].copy() for name, array in self._kept.items()} | window)

    def restore(self, slot: int, memory: Memory) -> None:
        """Make a slot hold what `recall` gave.

        Raises:
            CheckpointMismatch: arrays of another model.
        """
        arrays = dict(memory.arrays)
        rotations, mask = arrays.pop("history", None), arrays.pop("history_mask", None)
        shapes = {name: (array.shape[1:], array.dtype) for name, array in self._kept.items()}
        if {name: (array.shape, array.dtype) for name, array in arrays.items()} != shapes:
            raise CheckpointMismatch("the checkpoint's state does not fit this model; start the body anew")
        for name, array in arrays.items():
            self._kept[name][slot] = array
        if rotations is not None and mask is not None:
            self.histories[slot] = History(rotations.astype(np.float32), mask.astype(np.float32))
