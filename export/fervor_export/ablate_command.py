"""`fervor ablate`: an entry point of the group `fervor.commands`."""

from pathlib import Path
from typing import Annotated

import typer


def ablate(  # noqa: PLR0917  # typer calls it by name
    data: Annotated[str, typer.Option(help="Data set: a folder, a manifest, or `synthetic`.")] = "synthetic",
    clips: Annotated[int, typer.Option(min=20, help="How many clips to synthesise, for `synthetic`.")] = 3000,
    epochs: Annotated[int, typer.Option(min=1, help="Of each training.")] = 5,
    seeds: Annotated[int, typer.Option(min=1, help="How often each variant is trained.")] = 2,
    data_seed: Annotated[int, typer.Option(help="Of the data and the split.")] = 0,
    only: Annotated[
        list[str] | None, typer.Option(help="A variant by its name, several times; the default goes along.")
    ] = None,
    threads: Annotated[int, typer.Option(min=1, help="Of torch.")] = 1,
    out: Annotated[Path, typer.Option(help="Folder of results, and of what is half done.")] = Path("ablation"),
    page: Annotated[
        Path | None, typer.Option(help="Write the table here too.", show_default="only in the folder")
    ] = None,
) -> None:
    """Train the default recipe with one choice changed at a time, and tell what each choice is worth.

    Killed and typed again, it goes on after the last epoch that was done.
    """
    from dataclasses import replace

    import torch

    from fervor_export.ablation import VARIANTS
    from fervor_export.ablation import ablate as run_ablation
    from fervor_export.ablation_page import as_json
    from fervor_export.ablation_page import page as write_page
    from fervor_export.data.dataset import SYNTHETIC
    from fervor_export.data.progress import loading_bar
    from fervor_export.material import gather
    from fervor_export.recipe import DEFAULT
    from fervor_export.watching import watching

    known = {variant.name: variant for variant in VARIANTS}
    if unknown := [name for name in only or () if name not in known]:
        raise typer.BadParameter(f"{', '.join(unknown)}: no variant; expected one of {', '.join(known)}")
    chosen = [known[name] for name in only] if only else list(VARIANTS)
    torch.set_num_threads(threads)
    recipe = replace(DEFAULT, epochs=epochs, patience=None)
    with loading_bar() as told:
        material = gather(data, recipe, clips=clips, seed=data_seed, progress=told)
    with watching((len(chosen) + 1) * seeds, epochs) as watcher:
        results = run_ablation(
            material,
            recipe,
            variants=chosen,
            seeds=seeds,
            folder=out / "trainings",
            tell=watcher.begin,
            on_epoch=watcher.epoch,
        )
    made = f" --clips {clips}" if data == SYNTHETIC else ""
    names = "".join(f" --only {name!r}" for name in only or ())
    command = (
        f"fervor ablate --data {data}{made} --epochs {epochs} --seeds {seeds} --data-seed {data_seed}"
        f"{names} --threads {threads}"
    )
    text = write_page(results, material, recipe, known, command=command)
    (out / "ablation.md").write_text(text, encoding="utf-8")
    (out / "ablation.json").write_text(as_json(results, command=command), encoding="utf-8")
    if page is not None:
        page.write_text(text, encoding="utf-8")
    typer.echo(text)
