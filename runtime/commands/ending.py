"""How a command ends: done, failed in one line, or stopped at once."""

import json
from collections.abc import Callable, Mapping

from lobstr_hw.errors import LobstrError
from lobstr_hw.runtime.stopping import StopRequest

__all__ = ["ended"]


def ended(
    run: Callable[[StopRequest], int],
    tell: Callable[[str], None],
    *,
    as_json: bool,
    stopped: str,
    stopped_code: int = 1,
    stopped_document: Mapping[str, object] | None = None,
) -> int:
    """Run a command; returns its exit code.

    Args:
        run: the work; its imports are slow, so it makes them itself: Ctrl-C is clean before them.
        tell: prints a line for people.
        as_json: stdout is one document, also of a failure.
        stopped: what to say when Ctrl-C was pressed twice, or before there was anything to stop.
        stopped_code: the exit code then.
        stopped_document: the document then, if any.
    """
    try:
        with StopRequest() as stop:
            return run(stop)
    except LobstrError as error:
        tell(str(error))
        if as_json:
            print(json.dumps({"error": str(error)}))
        return 1
    except KeyboardInterrupt:
        tell(stopped)
        if as_json and stopped_document is not None:
            print(json.dumps(stopped_document))
        return stopped_code
