"""The ablation as a page of the documentation, and as JSON."""

import json
from collections.abc import Mapping

import numpy as np

from fervor_export.ablation import BASE, DRIFT_MINUTES, MEASURES, Measure, Results, Variant
from fervor_export.material import Material
from fervor_export.recipe import Recipe

NOTABLE = 0.005
"""Differences below are not told, even where all seeds agree."""


def page(results: Results, material: Material, recipe: Recipe, variants: Mapping[str, Variant], *, command: str) -> str:
    """The results in Markdown.

    Args:
        results: of `ablate`, the default among them.
        material: what was learned from.
        recipe: the default.
        variants: by name.
        command: what was typed.
    """
    count = len(results[BASE.name])
    seeds = f"{count} seeds" if count > 1 else "one seed"
    seen, test = len(material.learn) + len(material.validate), len(material.test)
    head = ["", *(measure.title for measure in MEASURES), "speaks for the default", "speaks against it"]
    rows = [f"| {' | '.join(head)} |", "|---|" + "---|" * (len(head) - 1)]
    for name in results:
        title = f"**{name}**" if name == BASE.name else f"{name} {_fields(variants[name], recipe)}"
        cells = [_cell(results[name], measure) for measure in MEASURES]
        rows.append(f"| {title} | {' | '.join(cells)} | {' | '.join(_verdicts(results, name))} |")
    return f"""# Ablation of the default recipe

What each choice of the recipe `{recipe.name}` is worth: one row a choice, undone or made otherwise. Written by

```sh
{command}
```

Data: {material.description}; {seen} clips to learn from and to choose the epoch by, judged by {test} clips of other
actors. {recipe.epochs} epochs, {seeds}, the same split for all. That is little: small differences are chance, and
what needs long training to pay shows less than it would.

Cells: mean ± standard deviation over seeds. All r are within emotion, of a clip's mean estimate after its first second.
*Staggered* and *one state*: mean absolute difference to a fresh state's estimate, over streams of {DRIFT_MINUTES}
minutes, under the service's default memory and under one state for ever. The last two columns name what is better, or
worse, with the default by {NOTABLE:g} or more for every single seed.

{chr(10).join(rows)}
"""


def as_json(results: Results, *, command: str) -> str:
    """The results, every seed by itself."""
    plain = {
        name: [{key: None if np.isnan(value) else round(value, 5) for key, value in seed.items()} for seed in seeds]
        for name, seeds in results.items()
    }
    return json.dumps({"command": command, "variants": plain}, indent=2) + "\n"


def _fields(variant: Variant, recipe: Recipe) -> str:
    said = ", ".join(f"{name} {value} for {getattr(recipe, name)}" for name, value in variant.changes.items())
    return f"(`{said}`)"


def _cell(seeds: list[dict[str, float]], measure: Measure) -> str:
    values = np.asarray([seed[measure.name] for seed in seeds])
    if np.isnan(values).any():
        return "-"
    spread = f" ± {values.std(ddof=1):.3f}" if len(values) > 1 else ""
    return f"{values.mean():.3f}{spread}"


def _verdicts(results: Results, name: str) -> tuple[str, str]:
    """Measures in which the default is better, and worse, for every seed."""
    good, bad = [], []
    for measure in MEASURES:
        pairs = zip(results[BASE.name], results[name], strict=True)
        ahead = np.asarray([base[measure.name] - other[measure.name] for base, other in pairs])
        ahead = ahead if measure.more_is_better else -ahead
        if (ahead >= NOTABLE).all():
            good.append(measure.title)
        elif (ahead <= -NOTABLE).all():
            bad.append(measure.title)
    return "; ".join(good), "; ".join(bad)
