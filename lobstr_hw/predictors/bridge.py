"""A point that was lost comes back: the network goes through the time between once more.

While a point is lost it is guessed (:mod:`lobstr_hw.lost_points`), and the network's state takes in
a wrong movement that it needs most of a second to forget. When the point is seen again both ends of
the gap are known. The guess is then bent so that it ends where the point is, and the network is
asked again from the state that it had before the loss. What was shown meanwhile stays as it was.

Each point has a gap of its own, and its own state from before it. When one comes back its gap is
filled, and those that are still lost stay as they were guessed; their states from before are those
of the mended past from then on. A gap of :data:`~gap_memory.FRAMES` steps is given up.
"""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from lobstr_hw.features import Bools, Form, Points, clip_features, reference_frames
from lobstr_hw.lost_points import follow
from lobstr_hw.predictors import gap_memory
from lobstr_hw.predictors.gap_memory import FRAMES, Ints
from lobstr_hw.predictors.predictor import State
from lobstr_hw.predictors.weights import Network
from lobstr_hw.rotations import Array, slerp, transpose

__all__ = [
    "NEVER",
    "all_seen",
    "begun",
    "bent",
    "bridged",
    "gap_part",
    "gone_on",
    "guessed",
    "last_points",
    "remembered",
    "shifted",
]

Float32 = npt.NDArray[np.float32]

GIVEN_UP = FRAMES
NEVER = FRAMES + 1
"""Instead of steps since a loss: too many, and none was ever seen."""
_IDENTITY = np.eye(3)


def begun(n: int, hidden_size: int) -> State:
    """Nobody was seen yet.

    Returns:
        lost (n, 4): steps since each point was last seen; kept (n, 4, H): the hidden state then;
        steps (n,) done; and the memory, in which a step has the slot of its number.
    """
    return {
        "lost": np.full((n, 4), NEVER),
        "kept": np.zeros((n, 4, hidden_size), dtype=np.float32),
        "steps": np.zeros(n, dtype=np.int64),
        **gap_memory.empty(n),
    }


def shifted(state: State, T: Array) -> State:
    """What moves along when the play space moves by T (n, 4, 4)."""
    return gap_memory.shifted(state, T)


def all_seen(state: State, now: Points) -> bool:
    """Whether everybody's points are there, in this step and the one before: nothing to do."""
    # a tenth of what any() and all() take, and this is in every step
    there = np.count_nonzero(now.valid_p & now.valid_R) == now.valid_p.size
    return bool(there and np.count_nonzero(state["lost"]) == 0)


def guessed(state: State, now: Points) -> Points:
    """The points (n, 4, ...) of which those that are lost, and were seen once, are guessed."""
    return follow(last_points(state), now, state["lost"] < NEVER)


def bridged(state: State, now: Points, linked: Bools, network: Network) -> State:
    """The state before a step, as if the points that are back in it had never been quite lost.

    Args:
        state: of ``Lobstr`` before the step.
        now: (n, 4, ...) points of the step.
        linked: (n,) whether the step before was one grid step ago.
        network: that the state is of.
    """
    lost, seen = state["lost"], _seen(now)
    fresh = (lost > 0) & (lost < GIVEN_UP) & linked[:, None]
    who = np.flatnonzero((fresh & seen).any(axis=-1))
    if not len(who):
        return state
    gaps = np.where(fresh & seen, lost, 0)[who]  # (m, 4) steps, 0 for who is not back
    still = np.where(fresh & ~seen, lost, 0)[who]
    steps = gaps.max(axis=-1)
    ages = np.arange(steps.max(), -1, -1)[:, None]  # steps before the last one
    slots = (state["steps"][who] - np.minimum(ages, steps)) % FRAMES  # (frames, m)
    form = network.card.feature_form
    points = _filled(gap_memory.read(state, who, slots), now.take(who), gaps, lost[who], form)
    x = clip_features(points, form, state["scale"][who])
    kept = state["kept"][who]
    hidden = _asked_again(network, x, kept, steps, np.argmax(gaps, axis=-1), still)
    i, k = np.nonzero((ages < steps) & still.any(axis=-1))
    memory = gap_memory.written(state, who[k], slots[i, k], points.take((i, k)))
    return {**_with_rows(state, who, points.take(-1), hidden, kept), **memory}


def _seen(points: Points) -> Bools:
    return points.valid_p & points.valid_R


def _filled(points: Points, now: Points, gaps: Ints, lost: Ints, form: Form) -> Points:
    """The time since before the longest gap (frames, m, 4, ...), what is back in it bent.

    Args:
        points: as they were remembered; up to the step before ``now``.
        now: (m, 4, ...).
        gaps: (m, 4) steps that each point was lost for, 0 for who is not back.
        lost: (m, 4) the same for all that were lost.
        form: of the network.
    """
    guess = gone_on(points.take(-1), now, lost < NEVER)
    off_p, off_R = now.p - guess.p, now.R @ transpose(guess.R)
    part_p, part_R = (gap_part(v) * (gaps > 0) for v in (points.valid_p, points.valid_R))
    p, R = bent(points.p, points.R, off_p, off_R, part_p, part_R)
    ages = np.arange(len(p) - 1, -1, -1)[:, None, None]
    valid_p, valid_R = (v | (ages < gaps) for v in (points.valid_p, points.valid_R))
    R_ref = reference_frames(R[:, :, 0], form, points.R_ref[0])
    return Points(p, R, valid_p, valid_R, R_ref)


def gone_on(last: Points, now: Points, seen: Bools) -> Points:
    """The points a step later, had nothing come back in it."""
    return follow(last, replace(now, valid_p=last.valid_p, valid_R=last.valid_R), seen)


def gap_part(valid: Bools) -> Array:
    """How much of the way over a gap each frame has behind it; 0 before it.

    Args:
        valid: (frames, ...) which were measured. The gap is what is not at the end, and ends one
            frame later.
    """
    steps = np.cumprod(~valid[::-1], axis=0).sum(axis=0)
    ages = np.arange(len(valid) - 1, -1, -1).reshape(-1, *(1,) * (valid.ndim - 1))
    return np.asarray(np.clip((steps - ages) / (steps + 1), 0.0, 1.0))


def bent(
    p: Array, R: Array, off_p: Array, off_R: Array, part_p: Array, part_R: Array
) -> tuple[Array, Array]:
    """Guessed points, led evenly to where they are seen again.

    Args:
        p: (frames, ..., 3) guessed.
        R: (frames, ..., 3, 3).
        off_p: (..., 3) by which the guess is off when the point is seen again.
        off_R: (..., 3, 3) the turn in the world from the guess to what is seen.
        part_p: (frames, ...) of the way from the last frame in which it was measured.
        part_R: (frames, ...) likewise.
    """
    return p + part_p[..., None] * off_p, slerp(_IDENTITY, off_R, part_R) @ R


def _asked_again(
    network: Network, x: Array, kept: Float32, steps: Ints, first: Ints, still: Ints
) -> Float32:
    """The hidden state (m, H) at the last of some frames; ``kept`` is brought up to date.

    Args:
        network: is asked.
        x: (frames, m, 37) features, not z-scored; people are asked in their last ``steps`` frames.
        kept: (m, 4, H) hidden states before each point was lost; written to.
        steps: (m,).
        first: (m,) which of the kept states to begin with.
        still: (m, 4) steps since the points were lost that stay so; 0 for others.
    """
    card = network.card
    z = (x.astype(np.float32) - card.input_mean) / card.input_scale
    hidden = kept[np.arange(len(kept)), first]
    lost_at = set(still[still > 0].tolist())
    for age in range(len(z) - 2, -1, -1):
        on = steps > age
        who = slice(None) if on.all() else np.flatnonzero(on)
        hidden[who], _, _ = network.step(z[len(z) - 1 - age, who], hidden[who])
        if age in lost_at:
            k, role = np.nonzero((still == age) & on[:, None])
            kept[k, role] = hidden[k]
    return hidden


def _with_rows(state: State, who: Ints, points: Points, hidden: Float32, kept: Float32) -> State:
    """A state in which some people's last points, hidden and kept states are others."""
    new = {
        "hidden": hidden, "kept": kept, "p": points.p, "R": points.R,
        "valid_p": points.valid_p, "valid_R": points.valid_R, "R_ref": points.R_ref,
    }  # fmt: skip
    out = dict(state)
    for name, rows in new.items():
        out[name] = state[name].copy()
        out[name][who] = rows
    return out


def remembered(state: State, now: Points, linked: Bools) -> State:
    """What :func:`begun` lists but the steps, after a step.

    Args:
        state: before it (:func:`bridged`).
        now: (n, 4, ...) points of the step.
        linked: (n,) whether the step before was one grid step ago.
    """
    before = state["lost"]
    lost = np.where(linked[:, None], before + 1, GIVEN_UP)
    lost = np.where(before == NEVER, NEVER, np.minimum(lost, GIVEN_UP))
    lost = np.where(_seen(now), 0, lost)
    kept = state["kept"]
    k, role = np.nonzero(lost == 1)
    if len(k):
        kept = kept.copy()
        kept[k, role] = state["hidden"][k]
    return {"lost": lost, "kept": kept, **_recorded(state, now, before, lost)}


def _recorded(state: State, now: Points, before: Ints, lost: Ints) -> State:
    """The memory, written for those with a gap that may be bridged yet."""
    on, was_on = (((steps > 0) & (steps < GIVEN_UP)).any(axis=-1) for steps in (lost, before))
    who = np.flatnonzero(on & ~was_on)  # the last step before the gap is one end of it
    slots = state["steps"] % FRAMES
    memory = gap_memory.written(state, who, slots[who], last_points(state).take(who))
    who = np.flatnonzero(on)
    return gap_memory.written(memory, who, (slots[who] + 1) % FRAMES, now.take(who))


def last_points(state: State) -> Points:
    """The points (n, 4, ...) of the step before."""
    return Points(*(state[name] for name in ("p", "R", "valid_p", "valid_R", "R_ref")))
