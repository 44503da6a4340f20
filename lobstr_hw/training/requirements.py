"""What training needs beyond the plain install."""

from lobstr_hw.errors import ModelError

__all__ = ["require_training_libraries"]


def require_training_libraries() -> None:
    """Tell what is missing, and the cure, before anything is begun.

    Raises:
        ModelError: torch, onnx or tqdm is not installed.
    """
    try:
        import onnx  # noqa: F401
        import torch  # noqa: F401
        import tqdm  # noqa: F401
    except ImportError as error:
        raise ModelError(
            f"{error.name!r} is not installed: training needs it. "
            "pip install torch==2.13.0 'lobstr-hw[train]'"
        ) from error
