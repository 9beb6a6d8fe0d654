"""The front door: every job as a function of Python, whose result is a table, a file or a page in one call.

`import rail_extract` gives these functions.

>>> from pathlib import Path
>>> import rail_extract as rx
>>> sample = Path(rx.__file__).parent / "resources" / "sample" / "sample.laz"
>>> network = rx.extract(sample, standard="IN_75R_1000", workers=1)
>>> network.figures["RAIL_COUNT"], network.figures["CENTERLINE_COUNT"]
(6, 3)
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from inspect import Parameter, Signature
from pathlib import Path
from typing import Any

from ..jobs import CALLS, declaration
from ..jobs.result import Result
from ..jobs.values import Job
from ..progress import SILENT
from .files import FileValues, run_with_files

__all__ = ["Result", "function_of"]


def __getattr__(name: str) -> Callable[..., Result]:
    """Return a job as a function."""
    if name not in CALLS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return function_of(CALLS[name])


def function_of(job: Job) -> Callable[..., Result]:
    """Return a job as a function whose arguments have the names of its parameters and outputs, in small letters.

    What must be given comes first; files of layers may be left out, because the result writes them as well.
    """
    stated = sorted((*job.parameters, *job.outputs), key=lambda one: (not one.required, not _is_needed(one)))

    def call(*args: Any, **given: Any) -> Result:
        values = signature.bind(*args, **given).arguments
        progress = values.pop("progress", SILENT)
        plain = {name: str(value) if isinstance(value, Path) else value for name, value in values.items()}
        command = f"rail_extract.{job.call}({', '.join(f'{name}={value!r}' for name, value in plain.items())})"
        named = {name.upper(): value for name, value in values.items()}
        return run_with_files(job, partial(FileValues, job, named, command, keeps=True), progress, _spelled)

    first, later = Parameter.POSITIONAL_OR_KEYWORD, Parameter.KEYWORD_ONLY
    arguments = [
        Parameter(
            one.name.lower(),
            first if one.required else later,
            default=Parameter.empty if _is_needed(one) else one.default,
        )
        for one in stated
    ]
    signature = Signature([*arguments, Parameter("progress", later, default=SILENT)], return_annotation=Result)
    texts = [f"{one.name.lower()}\n    {one.label}. {one.help}" for one in stated]
    call.__name__, call.__signature__ = job.call, signature  # type: ignore[attr-defined]
    call.__doc__ = "\n".join([job.summary, "", job.help, "", "Parameters", "----------", *texts])
    return call


def _is_needed(one: declaration.Parameter) -> bool:
    """Return whether a value must be given: the result keeps layers, so that their files need not be named."""
    return one.required and not isinstance(one, declaration.LayerOutput)


def _spelled(one: declaration.Parameter) -> str:
    """Return how Python names a parameter."""
    return one.name.lower()
