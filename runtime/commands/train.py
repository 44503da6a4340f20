"""lobstr-train: train the network, or export a run."""

import argparse
import json
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lobstr_hw.errors import LobstrError, ModelError
from lobstr_hw.runtime.stopping import StopRequest
from lobstr_hw.training.requirements import require_training_libraries

if TYPE_CHECKING:
    from lobstr_hw.training.checkpoint import Run
    from lobstr_hw.training.config import TrainingConfig
    from lobstr_hw.training.dataset import Clips
    from lobstr_hw.training.processes import Processes

__all__ = ["main"]

EXAMPLES = """examples:
  lobstr-train DATA --out runs/1 --seed 1      train the paper's recipe on the default split
  lobstr-train DATA --out runs/2 --recipe carried     a small network for live use
  lobstr-train DATA --out runs/1 --resume      go on after a stop
  lobstr-train --export runs/1 lobstr.onnx     write lobstr.onnx and lobstr.json
  lobstr-train DATA --out runs/4 --recipe carried --teacher runs/2 --teacher runs/3
                                               the same, which also listens to others
  torchrun --nproc-per-node 4 -m lobstr_hw.runtime.commands.train DATA --out runs/3
                                               four processes share each batch
"""
LEFT_OUT = {"P": {"toe": 0.0, "velocity": 0.0}, "PK": {"velocity": 0.0}}
"""Weights of the losses that a combination (the paper's Table 2) does not have."""


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
    parser.add_argument("--steps", type=int, help="of one batch (1500; carried 3000; two-way 2300)")
    parser.add_argument(
        "--everybody",
        action="store_true",
        default=None,
        help="train on the people of the validation part too, and validate nothing",
    )
    parser.add_argument("--seed", type=int, help="of weights, windows and errors (1)")
    parser.add_argument(
        "--teacher",
        dest="teachers",
        action="append",
        metavar="DIR",
        help="a finished run of --recipe carried to listen to (repeatable)",
    )
    parser.add_argument(
        "--precision", choices=("fp32", "bf16"), help="of the products (paper fp32, others bf16)"
    )
    parser.add_argument(
        "--device", choices=("auto", "cpu", "cuda"), help="auto (default): an accelerator if any"
    )
    parser.add_argument(
        "--network", choices=("gru", "lstm", "rnn", "fc6", "cnn1d"), help="kind (gru), for tables"
    )
    parser.add_argument(
        "--features",
        dest="feature_form",
        choices=("v1", "paper", "position", "combined"),
        help="form of the input (v1), for tables",
    )
    parser.add_argument(
        "--losses",
        choices=("P", "PK", "PKV"),
        help="of pose, toes (K) and their velocity (V), beside contact; all by default",
    )
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
    from lobstr_hw.training.processes import processes

    split = read_split(options.split) if options.split else default_split()
    out: Path = options.out
    out.mkdir(parents=True, exist_ok=True)
    config = _config(options)
    with processes() as who:
        with who.one_goes_ahead():
            clips = gather(options.data, split, options.cache or out / "cache", _retargeting_bar)
        parts = ("train", "validation") if config.everybody else ("train",)
        train = part_of_clips(clips, split, *parts)
        held_out = who.first and not config.everybody
        validation = part_of_clips(clips, split, "validation") if held_out else None
        run = _start(out, config, train, options.resume, who)
        if who.first:
            _write_json(out / "data.json", describe(train, split) | {"parts": parts})
        _run(out, run, config, (train, validation or None), who)
    return 0


def _config(options: argparse.Namespace) -> "TrainingConfig":
    from lobstr_hw.training.config import read_config, recipe_config

    keys = ("steps", "seed", "precision", "device", "network", "feature_form", "everybody")
    named = {key: getattr(options, key) for key in keys}
    changes: dict[str, Any] = {key: value for key, value in named.items() if value is not None}
    if options.teachers:
        changes["teachers"] = tuple(options.teachers)
    kept = options.out / "config.json"
    source = options.config or (kept if options.resume else None)
    if source:
        config = read_config(source, **changes)
    else:
        config = recipe_config(options.recipe or "paper", **changes)
    left_out = LEFT_OUT.get(options.losses, {})
    return replace(config, weights=replace(config.weights, **left_out)) if left_out else config


def _start(
    out: Path, config: "TrainingConfig", train: "Clips", resume: bool, who: "Processes"
) -> "Run":
    from lobstr_hw.training.checkpoint import load_checkpoint, new_run
    from lobstr_hw.training.config import write_config
    from lobstr_hw.training.dataset import statistics
    from lobstr_hw.training.processes import part_of

    checkpoint = out / "checkpoint.pt"
    if resume:
        run = load_checkpoint(checkpoint, config)
        run.carried = part_of(run.carried, who)
        _check_steps(out / "config.json", config)
    elif checkpoint.exists():
        raise ModelError(f"{checkpoint} exists: go on with --resume, or give another --out.")
    else:
        run = new_run(config, statistics(train, config))
    if who.first:
        write_config(out / "config.json", config)
    return run


def _check_steps(kept: Path, config: "TrainingConfig") -> None:
    from lobstr_hw.training.config import read_config

    planned = read_config(kept).steps
    if config.schedule == "cosine" and planned != config.steps:
        raise ModelError(
            f"this run's learning rate was laid out for {planned} steps and would jump up again: "
            f"go on without --steps, or start anew with --steps {config.steps} in another --out."
        )


def _run(
    out: Path,
    run: "Run",
    config: "TrainingConfig",
    clips: "tuple[Clips, Clips | None]",
    who: "Processes",
) -> None:
    from tqdm import tqdm

    from lobstr_hw.training.loop import train
    from lobstr_hw.training.processes import average_gradients, share_of

    average_gradients(run.network, who)
    spent, began = run.wall_s, time.perf_counter()
    bar = tqdm(
        total=config.steps, initial=run.step, unit="step", file=sys.stderr, disable=not who.first
    )
    with bar, StopRequest() as stop:
        for _ in train(run, *clips, share_of(config, who)):
            run.wall_s = spent + time.perf_counter() - began
            bar.update()
            bar.set_postfix(_figures(run), refresh=False)
            last, stopping = run.step == config.steps, who.any(stop())
            if run.step % config.checkpoint_every == 0 or last or stopping:
                _keep(out, run, who)
            if stopping and not last:
                _say(f"stopped after step {run.step}; go on with --resume")
                return


def _figures(run: "Run") -> dict[str, str]:
    figures = {"loss": f"{run.curve[-1][1]:.4f}"}
    if run.validation:
        figures["toe_cm"] = f"{run.validation[-1][1]:.2f}"
    return figures


def _keep(out: Path, run: "Run", who: "Processes") -> None:
    from lobstr_hw.training.checkpoint import save_checkpoint
    from lobstr_hw.training.plots import plot_curves, write_curves
    from lobstr_hw.training.processes import gathered

    run = replace(run, carried=gathered(run.carried, who))
    if not who.first:
        return
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
