"""A data set as clips: generated motion, EBMDB in either layout, or anything that a manifest lists.

    data = load_dataset("path/to/ebmdb")
    data.clips, data.sha256, data.findings

Rules. What a source is, is told by what lies there. `check_dataset` never raises for a bad row or file: it collects
findings. `load_dataset` raises where nothing is left to use, and where a manifest, which is the user's own to mend, has
anything unusable. The same motion under two names is one recording if one person moved; if two did, it is left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from fervor.errors import DataError
from fervor_export.clip import Clip, digest
from fervor_export.data.bones import shared_bones
from fervor_export.data.cache import Ask, default_cache
from fervor_export.data.ebmdb import find_metadata, list_ebmdb
from fervor_export.data.ebmdb_names import RATE_HZ as EBMDB_HZ
from fervor_export.data.ebmdb_tags import NAMES, list_tags
from fervor_export.data.label import NEUTRAL
from fervor_export.data.listing import Entry, Finding, Kind, Listing, one_sentence
from fervor_export.data.loading import Progress, load_motions, quietly
from fervor_export.data.manifest import NAME, list_manifest
from fervor_export.data.motion import Motion
from fervor_export.data.twins import find_twins

SYNTHETIC = "synthetic"
"""The source that is no path."""

CAST_CLIPS = 1000
"""Synthetic clips of one cast of actors; more clips have more casts, and another seed has others."""

LEAK = "a leak between folds"
"""How the finding of a recording that is another actor's or split's too ends."""

ONE_BODY = "have the same bones to the last digit, and others have others: one person under several names?"
"""What is said of actors whose files show one body."""

LENGTHS_APART_S = 0.25
"""How far a recording's length may be from what its name says."""


@dataclass(frozen=True, slots=True, eq=False)
class Take:
    """One entry of a data set whose motion could be read."""

    entry: Entry
    motion: Motion
    recording: str
    """The name that clips of the same motion share."""
    clip: Clip | None
    """None where the data set gives no label, or where the motion is another actor's too."""


@dataclass(frozen=True, slots=True, eq=False)
class Dataset:
    """Clips, where they come from, and what was wrong."""

    kind: Kind
    source: str
    description: str
    clips: list[Clip] = field(repr=False)
    takes: tuple[Take, ...] = field(default=(), repr=False)
    """What was read from files, in order; none for generated motion."""
    findings: tuple[Finding, ...] = ()
    splits: dict[str, list[Clip]] = field(default_factory=dict, repr=False)
    """Clips by the split that a manifest gives them: train, validation, test."""

    @property
    def sha256(self) -> str:
        """Of all clips, labels included, in order."""
        return digest(self.clips)

    @property
    def purpose(self) -> Literal["demo", "research"]:
        """A model of generated motion is a demo."""
        return "demo" if self.kind == "synthetic" else "research"

    @property
    def intense(self) -> list[Clip]:
        """Clips whose label is an intensity: recognised as neutral is none."""
        return [clip for clip in self.clips if clip.emotion != NEUTRAL]

    @property
    def neutral(self) -> list[Clip]:
        """The other clips."""
        return [clip for clip in self.clips if clip.emotion == NEUTRAL]

    @property
    def unusable(self) -> list[Finding]:
        """What had to be left out, though it should not be."""
        return [finding for finding in self.findings if finding.severity == "unusable"]

    @property
    def notes(self) -> tuple[str, ...]:
        """What whoever reads figures of these clips must know: sentences."""
        bad = self.unusable
        leaks = sum(finding.what.endswith(LEAK) for finding in bad)
        said = (
            (bad, f"Rows and files left out, as they can't be used: {len(bad)}; `fervor data check` lists them."),
            (leaks, f"Recordings left out, as they repeat one of another actor or split: {leaks}."),
        )
        bodies = (f"{finding.where[0].upper()}{finding.where[1:]} {ONE_BODY}" for finding in self.findings
                  if finding.what == ONE_BODY)  # fmt: skip
        return (*(sentence for applies, sentence in said if applies), *bodies)


def load_dataset(
    source: str | Path,
    *,
    cache: Path | None = None,
    processes: int | None = None,
    progress: Progress = quietly,
    clips: int = CAST_CLIPS,
    seed: int = 0,
    votes: bool = False,
) -> Dataset:
    """The clips of a data set.

    Args:
        source: "synthetic", a folder in either of EBMDB's layouts, a manifest, or a folder with a `manifest.csv`.
        cache: folder of motions that were read before; by default the user's.
        processes: to read files with; by default one for each processor that is ours.
        progress: told how many files are done, of how many.
        clips: for "synthetic": how many.
        seed: for "synthetic".
        votes: for "synthetic": whether labels have the noise of a panel of observers.

    Raises:
        DataError: the source is none of these, nothing in it can be used, or a manifest has problems. The notes of the
            error are the findings, one each.
    """
    if source == SYNTHETIC:
        return _synthesise(clips, seed, votes=votes)
    data = check_dataset(source, cache=cache, processes=processes, progress=progress)
    if data.unusable and (data.kind == "manifest" or not data.clips):
        error = DataError(one_sentence(data.findings, str(source)))
        for finding in data.unusable:
            error.add_note(str(finding))
        raise error
    if not data.clips:
        raise DataError(f"{source}: no recording in it; expected motion files")
    return data


def check_dataset(
    source: str | Path, *, cache: Path | None = None, processes: int | None = None, progress: Progress = quietly
) -> Dataset:
    """Everything that there is to say about files on disk; as `load_dataset`, but bad rows and files are findings.

    Raises:
        DataError: the source is no data set at all.
    """
    listing = find_listing(Path(source))
    asked = [Ask(entry.file, entry.skeleton, entry.start_s, entry.end_s) for entry in listing.entries]
    answers = load_motions(asked, cache=cache or default_cache(), processes=processes, progress=progress)
    pairs: list[tuple[Entry, Motion]] = []
    for entry, answer in zip(listing.entries, answers, strict=True):
        if isinstance(answer, Motion):
            pairs.append((entry, answer))
            _check_motion(listing, entry, answer)
        else:
            listing.unusable(entry.where, answer)
    for people in shared_bones((entry.actor, motion.bones) for entry, motion in pairs):
        listing.doubt(f"actors {', '.join(people)}", ONE_BODY)
    takes = _takes(listing, pairs)
    clips = [take.clip for take in takes if take.clip]
    actors = len({clip.actor for clip in clips})
    return Dataset(
        kind=listing.kind,
        source=str(source),
        description=f"{listing.description}: {len(clips)} clips of {actors} actor{'s' if actors != 1 else ''}",
        clips=clips,
        takes=tuple(takes),
        findings=tuple(sorted(listing.findings, key=lambda finding: finding.place)),
        splits=_splits(takes),
    )


def find_listing(source: Path) -> Listing:
    """What a source on disk says of its recordings.

    Raises:
        DataError: it is no data set, or its table can't be read.
    """
    if source.is_file():
        return list_manifest(source)
    if not source.is_dir():
        raise DataError(f"{source}: neither a folder nor a manifest; expected one, or {SYNTHETIC!r}")
    if (source / NAME).is_file():
        return list_manifest(source / NAME)
    if (source / NAMES).is_file():
        return list_tags(source)
    if find_metadata(source) is not None:
        return list_ebmdb(source)
    raise DataError(f"{source}: no data set; expected EBMDB's table or tags, or a {NAME}")


def _synthesise(clips: int, seed: int, *, votes: bool) -> Dataset:
    from fervor_export.synthetic import synthesise_dataset

    casts = range(-(-clips // CAST_CLIPS))
    made = [
        clip
        for cast in casts
        for clip in synthesise_dataset(
            clips=min(CAST_CLIPS, clips - CAST_CLIPS * cast), seed=1000 * seed + cast, votes=votes
        )
    ]
    description = "procedurally generated expressive motion, no recordings of people"
    return Dataset("synthetic", SYNTHETIC, description, made)


def _check_motion(listing: Listing, entry: Entry, motion: Motion) -> None:
    """Tells what does not fit the data set, or looks wrong."""
    if motion.doubt:
        listing.doubt(entry.where, motion.doubt)
    if entry.told_s is not None and abs(entry.told_s - motion.seconds) > LENGTHS_APART_S:
        listing.doubt(entry.where, f"it is {motion.seconds:.2f} s long; its name says {entry.told_s:.2f} s")
    if listing.kind != "manifest" and abs(motion.rate_hz / EBMDB_HZ - 1.0) > 0.01:
        listing.doubt(entry.where, f"it has {motion.rate_hz:.1f} frames a second; EBMDB has {EBMDB_HZ:g}")


def _takes(listing: Listing, pairs: Sequence[tuple[Entry, Motion]]) -> list[Take]:
    """Takes of all that was read; twins share a recording, and those of two actors have no clip."""
    recordings = [entry.name for entry, _ in pairs]
    left_out: set[int] = set()
    for twins in find_twins([motion for _, motion in pairs]):
        first, second = pairs[twins.first][0], pairs[twins.second][0]
        if first.file == second.file or {twins.first, twins.second} & left_out:
            continue
        same = f"{'a mirror image of ' if twins.mirrored else ''}the same motion as {first.where}"
        if (first.actor, first.split) == (second.actor, second.split):
            listing.doubt(second.where, f"it is {same}, so the two count as one recording")
            recordings = [recordings[twins.first] if name == recordings[twins.second] else name for name in recordings]
        else:
            what = f"actor {first.actor}" if first.actor != second.actor else f"in the split {first.split or 'none'}"
            listing.unusable(second.where, f"it is {same}, {what}: {LEAK}")
            left_out.add(twins.second)
    return [
        Take(entry, motion, recording, None if index in left_out else _clip(entry, motion, recording))
        for index, ((entry, motion), recording) in enumerate(zip(pairs, recordings, strict=True))
    ]


def _clip(entry: Entry, motion: Motion, recording: str) -> Clip | None:
    if entry.label is None:
        return None
    first, *others = motion.phases
    return Clip(
        rotations=first.rotations,
        mask=first.mask,
        emotion=entry.emotion,
        intensity=entry.label.intensity,
        actor=entry.actor,
        name=recording,
        observers=entry.label.observers,
        phases=tuple(others),
    )


def _splits(takes: Sequence[Take]) -> dict[str, list[Clip]]:
    splits: dict[str, list[Clip]] = {}
    for take in takes:
        if take.clip and take.entry.split:
            splits.setdefault(take.entry.split, []).append(take.clip)
    return splits
