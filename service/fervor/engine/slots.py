"""What the engine keeps of every body: preallocated arrays, a row ("slot") a body.

A slot's first ticket is `fresh` and clears it, so that releasing costs nothing.
"""

from collections import deque

import numpy as np
import numpy.typing as npt

from fervor.emotions import EMOTIONS
from fervor.engine.history import History
from fervor.engine.posing import Poses
from fervor.errors import CheckpointMismatch, Overloaded
from fervor.metadata import ModelMetadata
from fervor.rotations import IDENTITY
from fervor.session.checkpoint import Memory
from fervor.session.lanes import LANES
from fervor.skeletons.positions import no_hinges
from fervor.skeletons.rig import JOINTS, UPPER_BODY


class Slots:
    """Arrays by slot; slots are claimed and released."""

    def __init__(self, capacity: int, metadata: ModelMetadata) -> None:
        joints = len(JOINTS)
        self.capacity = capacity
        self.pose = np.tile(IDENTITY, (capacity, joints, 1))  # [slot, joint, 4] xyzw, the newest pose, holes held
        self.observed = np.zeros((capacity, joints), np.bool_)  # [slot, joint]
        self.jumps = np.zeros((capacity, joints), np.int64)  # [slot, joint] frames rejected in a row
        self.hinges = no_hinges((capacity,))  # [slot, limb, bone, 3] landmark sensors: axes of limbs last bent
        self.states = {
            state.name: np.zeros((capacity, LANES, *state.shape), np.float32) for state in metadata.states
        }  # name → [slot, lane, *shape]
        self.histories: dict[int, History] = {}  # slot → its last poses, for bodies with memory `window` only
        self.intensity = np.full(capacity, np.nan, np.float64)  # [slot], nan: no step yet
        self.by_emotion = np.zeros((capacity, len(EMOTIONS)), np.float64)  # [slot, emotion]
        self.seen = np.zeros(capacity, np.int64)  # [slot] upper-body joints observed
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

    def clear(self, slots: npt.NDArray[np.intp]) -> None:
        """Forget what these slots [any] hold; states are zeroed by the lanes that restart."""
        self.pose[slots], self.observed[slots], self.jumps[slots], self.hinges[slots] = IDENTITY, False, 0, 0.0
        for slot in slots.tolist():
            self.histories.pop(slot, None)
        self.intensity[slots], self.by_emotion[slots], self.seen[slots] = np.nan, 0.0, 0

    def move(
        self,
        slots: npt.NDArray[np.intp],
        posed: npt.NDArray[np.bool_],
        *,
        new: Poses,
        jumps: npt.NDArray[np.int64],
        hinges: npt.NDArray[np.float64] | None,
    ) -> None:
        """Take the newest poses of those slots [row] that have one (`posed` [row]); hinges None: no sensor has any."""
        if not posed.all():
            slots, new, jumps = slots[posed], new.rows(posed), jumps[posed]
            hinges = None if hinges is None else hinges[posed]
        self.pose[slots], self.observed[slots], self.jumps[slots] = new.rotations, new.observed, jumps
        self.seen[slots] = np.count_nonzero(new.observed[:, UPPER_BODY], axis=1)
        if hinges is not None:
            self.hinges[slots] = hinges

    def recall(self, slot: int) -> Memory:
        """Copies of all that a slot holds."""
        history = self.histories.get(slot)
        window = {} if history is None else {"history": history.rotations, "history_mask": history.mask}
        return Memory({name: array[slot].copy() for name, array in self._arrays().items()} | window)

    def restore(self, slot: int, memory: Memory) -> None:
        """Make a slot hold what `recall` gave.

        Raises:
            CheckpointMismatch: arrays of another model.
        """
        arrays = dict(memory.arrays)
        rotations, mask = arrays.pop("history", None), arrays.pop("history_mask", None)
        known = self._arrays()
        shapes = {name: (array.shape[1:], array.dtype) for name, array in known.items()}
        if {name: (array.shape, array.dtype) for name, array in arrays.items()} != shapes:
            raise CheckpointMismatch("the checkpoint's state does not fit this model; start the body anew")
        for name, array in arrays.items():
            known[name][slot] = array
        if rotations is not None and mask is not None:
            self.histories[slot] = History(rotations.astype(np.float32), mask.astype(np.float32))

    def _arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """Everything kept by slot, by name."""
        return {
            "pose": self.pose,
            "observed": self.observed,
            "jumps": self.jumps,
            "hinges": self.hinges,
            "intensity": self.intensity,
            "by_emotion": self.by_emotion,
            "seen": self.seen,
            **{f"state.{name}": state for name, state in self.states.items()},
        }
