"""lobstr-train: train the network, or export a run."""

import argparse
import json
import sys
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lobstr_hw.errors import LobstrError, ModelError
from lobstr_hw.runtime.stopping import StopRequest
from lobstr_hw.training.requirements import require_training_libraries

if TYPE_CHECKING:
    from lobstr_hw.training.checkpoint import Run
    from lobstr_hw.training.config import TrainingConfig
    from lobstr_hw.training.dataset import Clips

__all__ = ["main"]

EXAMPLES = """examples:
  lobstr-train DATA --out runs/1 --seed 1      train the paper's recipe on the default split
  lobstr-train DATA --out runs/2 --recipe carried     the small network that ships
  lobstr-train DATA --out runs/1 --resume      go on after a stop
  lobstr-train --export runs/1 lobstr.onnx     write lobstr.onnx and lobstr.json
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if bool(options.export) == bool(options.data):
        parser.error("give DATA... to train on, or --export DIR OUT")
    if any("=" not in named for named in options.metrics):
        parser.error("--metrics takes NAME=FILE")
    if options.data and not options.out:
        parser.error("--out DIR is needed: where the run is kept")
    try:
        require_training_libraries()
        return _export(options) if options.export else _train(options)
    except LobstrError as error:
        _say(str(error))
        return 1
    except KeyboardInterrupt:
        _say("stopped before the first step")
        return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="lobstr-train",
        description="Train the network on motion clips (BVH), or export a run.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("data", nargs="*", metavar="DATA", help="BVH files or folders")
    parser.add_argument("--split", type=Path, metavar="FILE", help="clips by part (JSON)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder of the run")
    parser.add_argument("--resume", action="store_true", help="go on from the last checkpoint")
    start = parser.add_mutually_exclusive_group()
    start.add_argument(
        "--recipe",
        choices=("paper", "carried", "two-way"),
        help="paper (default): windows from zero; carried: the state goes on, as in live use; "
        "two-way: for recordings, the future is known too",
    )
    start.add_argument("--config", type=Path, metavar="FILE", help="a config.json to start from")
    parser.add_argument("--steps", type=int, help="of one batch (1500; carried 4000; two-way 2600)")
    parser.add_argument("--seed", type=int, help="of weights, windows and errors (1)")
    parser.add_argument("--precision", choices=("fp32", "bf16"), help="of the products (fp32)")
    parser.add_argument("--cache", type=Path, metavar="DIR", help="retargeted clips (OUT/cache)")
    parser.add_argument(
        "--export", nargs=2, type=Path, metavar=("DIR", "OUT"), help="write weights"
    )
    parser.add_argument(
        "--metrics",
        action="append",
        default=[],
        metavar="NAME=FILE",
        help="with --export: a document of lobstr-evaluate for the card (repeatable)",
    )
    return parser


def _export(options: argparse.Namespace) -> int:
    from lobstr_hw.training.shipping import export_run

    folder, out = options.export
    if out.suffix != ".onnx":
        out = out / "lobstr.onnx"
    metrics = dict(named.split("=", 1) for named in options.metrics)
    error = export_run(folder, out, {name: Path(file) for name, file in metrics.items()})
    print(f"wrote {out} and {out.with_suffix('.json').name}")
    print(f"storing float16 moves the pose by at most {error.pose:.1e}", file=sys.stderr)
    return 0


def _train(options: argparse.Namespace) -> int:
    from lobstr_hw.splits import default_split, read_split
    from lobstr_hw.training.gather import describe, gather, part_of_clips

    split = read_split(options.split) if options.split else default_split()
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)
    config = _config(options)
    clips = gather(options.data, split, options.cache or out / "cache", _retargeting_bar)
    train = part_of_clips(clips, split, "train")
    validation = part_of_clips(clips, split, "validation")
    _write_json(out / "data.json", describe(train, split))
    run = _start(out, config, train, options.resume)
    _run(out, run, config, train, validation if len(validation) else None)
    return 0


def _config(options: argparse.Namespace) -> "TrainingConfig":
    from lobstr_hw.training.config import read_config, recipe_config

    named = {key: getattr(options, key) for key in ("steps", "seed", "precision")}
    changes = {key: value for key, value in named.items() if value is not None}
    kept = options.out / "config.json"
    source = options.config or (kept if options.resume else None)
    if source:
        return read_config(source, **changes)
    return recipe_config(options.recipe or "paper", **changes)


def _start(out: Path, config: "TrainingConfig", train: "Clips", resume: bool) -> "Run":
    from lobstr_hw.training.checkpoint import load_checkpoint, new_run
    from lobstr_hw.training.config import write_config
    from lobstr_hw.training.dataset import statistics

    checkpoint = out / "checkpoint.pt"
    if resume:
        return load_checkpoint(checkpoint, config)
    if checkpoint.exists():
        raise ModelError(f"{checkpoint} exists: go on with --resume, or give another --out.")
    write_config(out / "config.json", config)
    return new_run(config, statistics(train, config))


def _run(
    out: Path, run: "Run", config: "TrainingConfig", train: "Clips", validation: "Clips | None"
) -> None:
    from tqdm import tqdm

    from lobstr_hw.training.loop import train as training

    spent, began = run.wall_s, time.perf_counter()
    bar = tqdm(total=config.steps, initial=run.step, unit="step", file=sys.stderr)
    with bar, StopRequest() as stop:
        for _ in training(run, train, validation, config):
            run.wall_s = spent + time.perf_counter() - began
            bar.update()
            bar.set_postfix(_figures(run), refresh=False)
            last = run.step == config.steps
            if run.step % config.checkpoint_every == 0 or last or stop():
                _keep(out, run)
            if stop() and not last:
                _say(f"stopped after step {run.step}; go on with --resume")
                return


def _figures(run: "Run") -> dict[str, str]:
    figures = {"loss": f"{run.curve[-1][1]:.4f}"}
    if run.validation:
        figures["toe_cm"] = f"{run.validation[-1][1]:.2f}"
    return figures


def _keep(out: Path, run: "Run") -> None:
    from lobstr_hw.training.checkpoint import save_checkpoint
    from lobstr_hw.training.plots import plot_curves, write_curves

    save_checkpoint(out / "checkpoint.pt", run)
    write_curves(out, run)
    plot_curves(out / "curve.png", run)


def _retargeting_bar(motions: Iterable[Any], total: int) -> Iterable[Any]:
    from tqdm import tqdm

    bar: Iterable[Any] = tqdm(
        motions, total=total, unit="clip", desc="retargeting", file=sys.stderr
    )
    return bar


def _say(text: str) -> None:
    print(f"lobstr-train: {text}", file=sys.stderr)


def _write_json(path: Path, document: dict[str, object]) -> None:
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
