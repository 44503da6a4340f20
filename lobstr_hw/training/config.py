"""Everything a training run depends on besides its data; saved beside the run."""

import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from lobstr_hw.errors import ModelError
from lobstr_hw.features import Form
from lobstr_hw.training.augmentation import Augmentation

__all__ = [
    "RECIPES",
    "STEPPED_KINDS",
    "CarriedSettings",
    "Device",
    "LossWeights",
    "NetworkKind",
    "Recipe",
    "TrainingConfig",
    "TwoWaySettings",
    "read_config",
    "recipe_config",
    "write_config",
]

Device = Literal["auto", "cpu", "cuda"]
NetworkKind = Literal["gru", "lstm", "rnn", "fc6", "cnn1d"]
STEPPED_KINDS: tuple[NetworkKind, ...] = ("gru", "lstm", "rnn")
"""Those that go from frame to frame with a state; the others see a whole window at once."""
Recipe = Literal["paper", "carried", "two-way"]
RECIPES: tuple[Recipe, ...] = ("paper", "carried", "two-way")


@dataclass(frozen=True, slots=True)
class LossWeights:
    """The paper's lambda 1 to 4.

    In the recipe ``carried``, ``toe`` weighs the mean of knee, ankle and toe base, and ``velocity``
    the true difference of two frames, in metres per grid step.
    """

    pose: float = 1.0
    toe: float = 0.1
    velocity: float = 0.1
    contact: float = 1e-6


@dataclass(frozen=True, slots=True)
class CarriedSettings:
    """What only the recipe ``carried`` has: episodes of clips, and what is done to them.

    Attributes:
        mean_chunks: of an episode (geometric, at most the clip); then the state is zero again.
        warm_up: frames of an episode without a loss, from a zero state nobody can know better.
        people_power: a person's share of the frames drawn goes with minutes to this power.
        motion_power: a kind of motion's share (speed, direction, low hips) likewise.
        most_often: no frame is drawn more often than this times the mean.
        warp_share: of the episodes that are played at another speed.
        warp_min, warp_max: of that speed; slower and faster people, for nothing.
        lever_m: deviation along each axis of a tracker's constant place off its joint; not up and
            down at the hips, for their height is what calibration scales by, and a network that
            saw it err would not believe it (measured: toes 3 cm too low in whoever stands low).
        dropout_share: of the episodes in which one role is lost for a while.
        sitting_share: of the episodes in which who only stands sits down now and then.
        stride_share: of the episodes in which somebody else's strides are taken.
        borrowed_hands: share of the streams whose hands are another stream's, in each chunk anew;
            teachers see the true ones.
        gradient_norm: longer gradients are cut; a carried state can explode.
    """

    mean_chunks: float = 10.0
    warm_up: int = 5
    people_power: float = 0.5
    motion_power: float = 0.75
    most_often: float = 8.0
    warp_share: float = 0.5
    warp_min: float = 0.7
    warp_max: float = 1.45
    lever_m: float = 0.02
    dropout_share: float = 0.2
    sitting_share: float = 0.0
    stride_share: float = 0.0
    borrowed_hands: float = 0.0
    gradient_norm: float = 1.0


@dataclass(frozen=True, slots=True)
class TwoWaySettings:
    """What only the recipe ``two-way`` has.

    Attributes:
        planted: weight of the velocity term once more, over feet that stand: what they do wrong
            there is skate.
        margin: frames at a chunk's end that are not scored, where the recording goes on beyond it.
        end_share: of the chunks' ends that stand for a recording's own; all is scored there but
            ``end_margin`` frames. Each end is drawn by itself.
        end_margin: see ``end_share``.
    """

    planted: float = 2.5
    margin: int = 20
    end_share: float = 0.25
    end_margin: int = 2


@dataclass(frozen=True, slots=True)
class TrainingConfig:
    """The paper's recipe by default (its appendix 3).

    Attributes:
        recipe: ``paper`` (windows from zero), or ``carried`` (chunks of streams; the state goes on
            from step to step, the loss is on every frame): then ``batch`` is the number of streams,
            ``window`` the frames of a chunk, and the validation is over whole clips; or ``two-way``
            (for recordings: both directions at once over single chunks, validated likewise).
        steps: the paper's "epochs"; each is one batch, as the authors' code has it.
        batch: windows in a step.
        window: frames in a window, from a zero state; the loss is on the last one.
        network: kind of the encoder; all but ``gru`` are for the tables.
        hidden_size: of the encoder.
        learning_rate, learning_rate_decay: Adam, and the factor per step.
        schedule: ``decay`` by that factor, or ``cosine``: a rise, then half a cosine over the
            steps.
        seed: of the first weights, the windows and their errors.
        precision: ``bf16`` is three times faster on processors that have it.
        device: ``auto`` takes an accelerator where there is one.
        threads: torch's; more than one does not pay on small machines.
        feature_form: ``v1``; the others are for the tables.
        contact_label: ``floor`` (height over a local floor, and speed), or ``paper`` (1 cm).
        mirror: half of the windows with left and right exchanged.
        teachers: folders of finished runs of the recipe ``carried`` that this one listens to.
        taught: share of the loss that is against what they say; the rest is against the truth.
        everybody: trained on the people of the validation part too, so nothing is validated; for
            weights that ship, with settings and steps that were chosen without it.
        average: of the weights over the steps: what the mean of before keeps in a step; 0 is none.
            Not in the recipe ``paper``. The mean is what is validated and exported.
        mirror_mean: the exported network answers for its mirror image too and says the mean.
        validation_windows: drawn once from the validation clips.
        validate_every, checkpoint_every: steps.
    """

    recipe: Recipe = "paper"
    steps: int = 1500
    batch: int = 256
    window: int = 45
    network: NetworkKind = "gru"
    hidden_size: int = 1024
    learning_rate: float = 1e-3
    learning_rate_decay: float = 0.999
    schedule: Literal["decay", "cosine"] = "decay"
    seed: int = 1
    precision: Literal["fp32", "bf16"] = "fp32"
    device: Device = "auto"
    threads: int = 1
    feature_form: Form = "v1"
    contact_label: Literal["floor", "paper"] = "floor"
    mirror: bool = True
    teachers: tuple[str, ...] = ()
    taught: float = 0.5
    everybody: bool = False
    average: float = 0.0
    mirror_mean: bool = False
    augmentation: Augmentation = field(default_factory=Augmentation)
    weights: LossWeights = field(default_factory=LossWeights)
    carried: CarriedSettings = field(default_factory=CarriedSettings)
    two_way: TwoWaySettings = field(default_factory=TwoWaySettings)
    validation_windows: int = 512
    validate_every: int = 50
    checkpoint_every: int = 50

    def __post_init__(self) -> None:
        """Refuse settings that go together badly before a training is spent on them.

        Raises:
            ModelError: says which, and what to change.
        """
        if self.network != "gru" and self.recipe != "paper":
            raise ModelError(
                f"network {self.network!r} with recipe {self.recipe!r}: the tables' networks are "
                "trained by windows. Take --recipe paper, or leave --network out."
            )
        if self.recipe == "two-way" and self.carried.mean_chunks != 1.0:
            raise ModelError(
                f"two-way with carried.mean_chunks {self.carried.mean_chunks:g}: each chunk is by "
                "itself. Set it to 1, or begin with --recipe two-way."
            )
        if self.mirror_mean and (self.recipe == "two-way" or not self.mirror):
            raise ModelError(
                "mirror_mean is for live networks that learnt from mirror images: set it to false, "
                "or mirror to true and another recipe."
            )
        if self.average > 0.0 and self.recipe == "paper":
            raise ModelError("average is not of the recipe paper: set it to 0, or take another.")
        if self.teachers and self.recipe != "carried":
            raise ModelError(
                f"teachers are for the recipe carried: {self.recipe} has none. Leave --teacher out."
            )
        if not 0.0 <= self.taught <= 1.0:
            raise ModelError(f"taught is a share of the loss: {self.taught:g} is not in 0 to 1.")


_CARRIED = TrainingConfig(
    recipe="carried",
    steps=3000,
    batch=64,
    window=60,
    hidden_size=384,
    learning_rate=3e-3,
    schedule="cosine",
    # less than half the time per step; the state stays float32
    precision="bf16",
    average=0.998,
    mirror_mean=True,
    # the position of three joints guides the legs; the contact gets a gradient that it can feel
    weights=LossWeights(pose=2.5, toe=1.0, velocity=6.0, contact=0.1),
    carried=CarriedSettings(sitting_share=0.15, stride_share=0.4, borrowed_hands=0.3),
    validate_every=1000,
    checkpoint_every=100,
)

_TWO_WAY = replace(
    _CARRIED,
    recipe="two-way",
    steps=2300,
    window=120,
    mirror_mean=False,
    # every chunk is an episode of its own
    carried=CarriedSettings(
        mean_chunks=1.0, sitting_share=0.5, stride_share=0.4, borrowed_hands=0.3
    ),
    validate_every=575,
    checkpoint_every=50,
)

_RECIPES = {"paper": TrainingConfig(), "carried": _CARRIED, "two-way": _TWO_WAY}


def recipe_config(recipe: Recipe, **changes: Any) -> TrainingConfig:
    """A recipe's own settings, with changes by name."""
    return replace(_RECIPES[recipe], **changes)


def write_config(path: Path, config: TrainingConfig) -> None:
    """Save as JSON."""
    path.write_text(json.dumps(asdict(config), indent=1) + "\n", encoding="utf-8")


def read_config(path: Path, **changes: Any) -> TrainingConfig:
    """Load what :func:`write_config` wrote; missing keys have their defaults.

    Raises:
        ModelError: it cannot be read, or names something that is no setting.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8")) | changes
        document["augmentation"] = Augmentation(**document.get("augmentation", {}))
        document["weights"] = LossWeights(**document.get("weights", {}))
        document["carried"] = CarriedSettings(**document.get("carried", {}))
        document["two_way"] = TwoWaySettings(**document.get("two_way", {}))
        document["teachers"] = tuple(document.get("teachers", ()))
        return TrainingConfig(**document)
    except (OSError, ValueError, TypeError) as error:
        raise ModelError(
            f"{path}: no training configuration ({error}). "
            "A run's folder has a config.json; --config takes one like it."
        ) from error
