"""OpenXR's actions: where hands and trackers are held, and which buttons are down."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from lobstr_hw.drivers.openxr.bindings import (
    BUTTONS,
    HANDS,
    TRACKERS,
    VIVE_TRACKER_PROFILE,
    bindings_of,
    profiles,
    tracker_bindings,
)
from lobstr_hw.trackers import TrackerRole

__all__ = ["Actions", "Press"]


@dataclass(frozen=True, slots=True)
class Press:
    """A button that changed."""

    role: TrackerRole
    name: str
    down: bool
    changed_s: float
    """Time of the runtime."""


class Actions:
    """One action set: a pose for every place, six buttons for either hand."""

    def __init__(self, xr: Any, instance: Any, session: Any, with_trackers: bool) -> None:
        """Make, suggest and attach all actions; none can be added later.

        Args:
            xr: the package.
            instance: of the runtime.
            session: not begun yet.
            with_trackers: the instance has the Vive trackers' extension.
        """
        self._xr, self._instance, self._session = xr, instance, session
        self.places: Mapping[TrackerRole, str] = {**HANDS, **(TRACKERS if with_trackers else {})}
        self._set = xr.create_action_set(
            instance, xr.ActionSetCreateInfo("body", "Body tracking", 0)
        )
        self._actions = {"pose": self._action("pose", self.places.values(), is_pose=True)}
        self._actions |= {name: self._action(name, HANDS.values()) for name in BUTTONS}
        for profile in profiles():
            self._suggest(profile, bindings_of(profile))
        if with_trackers:
            self._suggest(VIVE_TRACKER_PROFILE, tracker_bindings())
        xr.attach_session_action_sets(session, xr.SessionActionSetsAttachInfo(1, [self._set]))
        self.spaces = {role: self._space(path) for role, path in self.places.items()}
        self._sync_info = xr.ActionsSyncInfo(1, [xr.ActiveActionSet(self._set, xr.NULL_PATH)])
        self._held = {role: self._query("pose", path) for role, path in self.places.items()}
        self._buttons = {
            (role, name): self._query(name, path)
            for role, path in HANDS.items()
            for name in BUTTONS
        }
        self._down: set[tuple[TrackerRole, str]] = set()

    def sync(self) -> None:
        """Have the runtime look at the controllers; without the focus it does not."""
        try:
            self._xr.sync_actions(self._session, self._sync_info)
        except self._xr.SessionNotFocused:
            return

    def active(self) -> Iterator[TrackerRole]:
        """The places at which the runtime has a device."""
        for role, query in self._held.items():
            if self._xr.get_action_state_pose(self._session, query).is_active:
                yield role

    def presses(self) -> Iterator[Press]:
        """What changed since the last call; what cannot be told counts as let go."""
        for key, query in self._buttons.items():
            state = self._xr.get_action_state_boolean(self._session, query)
            down = bool(state.current_state)  # false by the standard where it is not active
            if down != (key in self._down):
                (self._down.add if down else self._down.discard)(key)
                yield Press(*key, down, state.last_change_time * 1e-9)

    def _action(self, name: str, paths: Iterable[str], is_pose: bool = False) -> Any:
        xr = self._xr
        kind = xr.ActionType.POSE_INPUT if is_pose else xr.ActionType.BOOLEAN_INPUT
        places = [self._path(path) for path in paths]
        return xr.create_action(
            self._set, xr.ActionCreateInfo(name, kind, len(places), places, name.capitalize())
        )

    def _suggest(self, profile: str, bindings: Iterable[tuple[str, str]]) -> None:
        xr = self._xr
        suggested = [
            xr.ActionSuggestedBinding(self._actions[action], self._path(path))
            for action, path in bindings
        ]
        try:
            xr.suggest_interaction_profile_bindings(
                self._instance,
                xr.InteractionProfileSuggestedBinding(
                    self._path(profile), len(suggested), suggested
                ),
            )
        except xr.PathUnsupportedError:  # a runtime need not know every controller
            return

    def _space(self, path: str) -> Any:
        info = self._xr.ActionSpaceCreateInfo(self._actions["pose"], self._path(path))
        return self._xr.create_action_space(self._session, info)

    def _query(self, action: str, path: str) -> Any:
        return self._xr.ActionStateGetInfo(self._actions[action], self._path(path))

    def _path(self, path: str) -> Any:
        return self._xr.string_to_path(self._instance, path)
