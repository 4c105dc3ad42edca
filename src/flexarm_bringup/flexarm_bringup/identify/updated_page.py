"""The page of identified modes with the description fitted to them, or without, and why."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.fitted_file import write_description
from flexarm_bringup.identify.halves import Halves
from flexarm_bringup.identify.other_poses import file_of
from flexarm_bringup.identify.retuning import retune
from flexarm_bringup.identify.run import Result
from flexarm_bringup.identify.updating import Fitting, add_to, fit_description
from flexarm_bringup.page.report import Page
from flexarm_bringup.progress import Progress
from flexarm_model.modal.fit import PoleFit

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Updated:
    """A page, and what became of the update that was asked for.

    Attributes:
        page: The modes, and the fit as far as it came.
        written: The new description; None where there is none.
        unmet: Why something that was asked for is not there; empty where all is.
    """

    page: Page
    written: Path | None = None
    unmet: str = ""


def with_update(
    page: Page,
    result: Result,
    args: argparse.Namespace,
    others: Sequence[tuple[Array, PoleFit]],
    halves: Halves | None,
) -> Updated:
    """Fit the description to identified modes, write it, choose settings for it: as far as options ask.

    Args:
        page: Of the modes.
        result: They.
        args: Of ``flexarm identify``.
        others: Other poses [rad or m], (n_theta,) each, and the modes there.
        halves: Whether one half of the records predicts the other; None where that is not known.
    """
    if not args.fit:
        return Updated(page)
    fit = result.own_fit
    if fit is None:
        return _without(page, "no mode was identified: there is nothing to fit to")
    if halves is not None and halves.fit.refusal:
        return _without(
            page, f"the identified model is refused, nothing is fitted to it: {halves.fit.refusal}"
        )
    fitting = Fitting(
        args.manipulator, args.preset, tuple(args.fit), tuple(args.pose), args.motors == "locked",
        args.update, () if result.is_reciprocal else result.responses.outputs,
    )  # fmt: skip
    return _fitted(page, fitting, fit, others, args)


def _fitted(
    page: Page,
    fitting: Fitting,
    fit: PoleFit,
    others: Sequence[tuple[Array, PoleFit]],
    args: argparse.Namespace,
) -> Updated:
    progress, written = Progress(), None
    try:
        update, test = fit_description(fitting, fit, others, progress.say)
        progress.done()
        modes, page = page, add_to(page, update, "", test)
        said = write_description(fitting, update, [*args.files, *map(file_of, args.also)])
        page, written = add_to(modes, update, said, test), fitting.output
        if written is not None and args.retune is not None:
            page = retune(args.manipulator, args.preset, written, update, args.retune, progress.say)(page)
    except (ValueError, OSError) as error:
        return _without(page, str(error), written)
    finally:
        progress.done()
    return Updated(page, written)


def _without(page: Page, why: str, written: Path | None = None) -> Updated:
    """Return the page of what there is, which says why the rest is missing."""
    remarks = {**page.remarks, "Not written": [why]}
    return Updated(Page(page.title, page.lead, page.items, page.checks, remarks, page.data), written, why)
