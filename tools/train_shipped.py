"""Train the network that ships: its teachers one after another, then the network that listens.

`--validated` leaves the people of the validation part out and validates on them: the training by
which settings are chosen. A stop (Ctrl-C, a kill) loses nothing: the same command goes on.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from lobstr_hw.runtime.commands.train import main as lobstr_train
from lobstr_hw.training.checkpoint import load_checkpoint
from lobstr_hw.training.config import TrainingConfig, recipe_config, write_config

SITTING_SHARE = 0.5
"""Of the teachers' episodes: what they say of chairs is to be relied on."""


def main() -> int:
    """Train what is missing under OUT, and export it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", nargs="+", metavar="DATA", help="BVH files or folders")
    parser.add_argument("out", type=Path, metavar="OUT", help="folder of the runs")
    parser.add_argument("--validated", action="store_true", help="without the validation people")
    options = parser.parse_args()
    (options.out / "settings").mkdir(parents=True, exist_ok=True)
    base = recipe_config("carried", everybody=not options.validated)
    for name, config in configurations(base, options.out).items():
        if not _train(options, name, config):
            print(f"{name} is not finished. Give the same command again to go on.", file=sys.stderr)
            return 1
    return lobstr_train(["--export", str(options.out / "lobstr"), str(options.out)])


def configurations(base: TrainingConfig, out: Path) -> dict[str, TrainingConfig]:
    """The settings of all runs by name, in the order in which they are trained.

    The teachers are unlike in size and in what they weigh, so that their errors are unlike.
    """
    sitting = replace(
        base,
        carried=replace(
            base.carried, sitting_share=SITTING_SHARE, stride_share=0.0, borrowed_hands=0.0
        ),
    )

    def teacher(hidden_size: int, steps: int, seed: int, **weights: float) -> TrainingConfig:
        weighed = replace(base.weights, pose=1.0, **weights)
        return replace(sitting, hidden_size=hidden_size, steps=steps, seed=seed, weights=weighed)

    teachers = {
        "large": teacher(512, 5000, 11, toe=1.5, velocity=7.0),
        "steady": teacher(384, 2400, 12, toe=1.0, velocity=9.0),
        "near": teacher(384, 2400, 13, toe=2.0, velocity=9.0),
    }
    return {**teachers, "lobstr": replace(base, teachers=tuple(str(out / n) for n in teachers))}


def _train(options: argparse.Namespace, name: str, config: TrainingConfig) -> bool:
    """Begin a run, or go on with it; whether it is finished."""
    run = options.out / name
    print(f"{name}: {config.steps} steps", file=sys.stderr)
    cache = ["--cache", str(options.out / "cache")]
    settings = options.out / "settings" / f"{name}.json"
    write_config(settings, config)
    begun = (run / "checkpoint.pt").exists()
    how = ["--resume"] if begun else ["--config", str(settings)]
    code = lobstr_train([*options.data, "--out", str(run), *cache, *how])
    return code == 0 and load_checkpoint(run / "checkpoint.pt", config).step == config.steps


if __name__ == "__main__":
    raise SystemExit(main())
