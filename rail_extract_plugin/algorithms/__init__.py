"""The algorithms of the toolbox: one for each job of the core, and two for the setup."""

from __future__ import annotations

from ...core.jobs import JOBS
from ...core.jobs.values import Job
from .base import JobAlgorithm, RailAlgorithm
from .check_installation import CheckInstallation
from .install_packages import InstallPackages


def _of(job: Job) -> type[RailAlgorithm]:
    """Return the algorithm of a job."""
    return type(job.name, (JobAlgorithm,), {"JOB": job, "__doc__": job.summary})


ALGORITHMS = (*map(_of, JOBS), InstallPackages, CheckInstallation)
"""The jobs, then the setup."""
