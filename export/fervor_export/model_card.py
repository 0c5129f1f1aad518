"""The model card: what a model file is, for people who are about to use it."""

from fervor.metadata import ModelMetadata

_INTENDED = {
    "demo": (
        "A procedural demo: it is there so that everything runs, and it is not science. It has never seen a person "
        "move. Its numbers show that the way from poses to intensities works; do not take them for what people would "
        "see in people."
    ),
    "research": "For research. Look at the data it learned from before you trust it with bodies of another kind.",
}

_SCORES = {
    "mae": "mean absolute error",
    "r": "Pearson r, all emotions but neutral",
    "r_all": "Pearson r, neutral too",
    "r_within": "Pearson r within emotion",
    "ccc": "concordance (CCC)",
    "spread": "spread of predictions / of targets",
}


_PARTS = {
    "test": "held-out clips",
    "validation": "clips that chose the epoch",
    "given": "out of fold, the data's own split",
    "recordings": "out of fold, by recording",
    "actors": "out of fold, actors left out",
}
"""What scores are of, by what stands before their names."""


def model_card(metadata: ModelMetadata, *, command: str, ended: str = "") -> str:
    """The card of a model file, in Markdown.

    Args:
        metadata: what the file says of itself.
        command: what trains it again.
        ended: a sentence to add if training ended before its time.
    """
    states = ", ".join(f"{state.name} {list(state.shape)}" for state in metadata.states)
    libraries = ", ".join(f"{name} {version}" for name, version in metadata.libraries.items())
    return f"""# {metadata.name} {metadata.version} ({metadata.purpose})

{_INTENDED[metadata.purpose]}

**What it says.** For every frame of a moving body and an emotion label, an intensity from 0 to 1: the share of
observers expected to recognise that emotion in the movement. Without a label, the share expected to recognise what
is meant, whatever it is. Neutral has no intensity of its own: there the number is how neutral the body looks.

**How it works.** Local rotations of {len(metadata.joints)} joints at {metadata.rate_hz:g} Hz, features
`{metadata.features}`, two LSTMs, one fully connected layer on descriptor and emotion (Sun et al., arXiv 1904.09435).
States: {states}.

**What it learned from.** {metadata.training.description[:1].upper()}{metadata.training.description[1:]}:
{metadata.training.recordings} recordings, {metadata.training.hours:g} hours; SHA-256
`{metadata.training.sha256[:16]}…`.{" " + ended if ended else ""}

{_scores(metadata)}

**Levels.** Weak below the threshold, strong from it on. A threshold is where the weaker and the stronger half of an
emotion's clips are told apart best, chosen by {metadata.levels.source or "nobody knows whose predictions"}.
Hysteresis ± {metadata.levels.hysteresis:g}, held at least {metadata.levels.dwell_s:g} s.

| {" | ".join(metadata.levels.threshold)} |
|{"---|" * len(metadata.levels.threshold)}
| {" | ".join(f"{value:.2f}" for value in metadata.levels.threshold.values())} |

**Again.** `{command}`, with {libraries}.

Licence: {metadata.license}.
"""


def _scores(metadata: ModelMetadata) -> str:
    """Scores as a table, a column for what they are of; and what that means."""
    parts = [part for part in _PARTS if any(f"{part}_{name}" in metadata.scores for name in _SCORES)]
    if not parts:
        return "Nobody has judged it."
    rows = ["| | " + " | ".join(_PARTS[part] for part in parts) + " |", "|---|" + "---|" * len(parts)]
    for name, title in _SCORES.items():
        values = [metadata.scores.get(f"{part}_{name}") for part in parts]
        if any(value is not None for value in values):
            rows.append(
                f"| {title} | " + " | ".join("-" if value is None else f"{value:.3f}" for value in values) + " |"
            )
    folds = not {"test", "validation"} & set(parts)
    note = (
        "Out of fold: every clip was judged by a network that learned from the others, by the same recipe. This "
        "network has learned from all of them, and nobody is left to judge it."
        if folds
        else "Nothing was learned from held-out clips, nor from those that chose the epoch."
    )
    return "\n".join([*rows, "", note])
