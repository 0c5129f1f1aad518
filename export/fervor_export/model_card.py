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
    "r": "Pearson r, all clips",
    "r_within": "Pearson r within emotion",
    "ccc": "concordance (CCC)",
    "spread": "spread of predictions / of targets",
}


def model_card(metadata: ModelMetadata, *, command: str) -> str:
    """The card of a model file, in Markdown.

    Args:
        metadata: what the file says of itself.
        command: what trains it again.
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
{metadata.training.recordings} clips, {metadata.training.hours:g} hours; SHA-256 `{metadata.training.sha256[:16]}…`.
Actors used to choose the epoch are no training actors; test actors are neither.

| | test | validation |
|---|---|---|
{_score_rows(metadata)}

**Levels.** Weak below the threshold, strong from it on: the median estimate for that emotion. Hysteresis
± {metadata.levels.hysteresis:g}, held at least {metadata.levels.dwell_s:g} s.

| {" | ".join(metadata.levels.threshold)} |
|{"---|" * len(metadata.levels.threshold)}
| {" | ".join(f"{value:.2f}" for value in metadata.levels.threshold.values())} |

**Again.** `{command}`, with {libraries}.

Licence: {metadata.license}.
"""


def _score_rows(metadata: ModelMetadata) -> str:
    rows = []
    for name, title in _SCORES.items():
        values = (metadata.scores.get(f"{part}_{name}") for part in ("test", "validation"))
        rows.append(f"| {title} | " + " | ".join("-" if value is None else f"{value:.3f}" for value in values) + " |")
    return "\n".join(rows)
