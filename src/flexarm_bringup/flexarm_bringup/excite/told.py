"""What a modal test over DDS tells of itself, as text: its bag can be read without knowing what was asked.

The signal is told by name, band, rate and length, which make it again.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from flexarm_bringup.excite.plan import Plan
from flexarm_model.identification.channel_findings import Finding
from flexarm_model.identification.excitation import excitation


@dataclass(frozen=True)
class ToldTest:
    """A modal test that has ended.

    Attributes:
        plan: What was to be done.
        findings: Of the sensor check, one per channel.
        ignored: Channels or sensors that were left out.
        starts_ns: Stamp from which the torque of every run acted [ns]; none when the sensors were refused.
        refusal: Why nothing was excited; empty when it was.
    """

    plan: Plan
    findings: tuple[Finding, ...]
    ignored: tuple[str, ...]
    starts_ns: tuple[int, ...]
    refusal: str = ""


def to_text(told: ToldTest) -> str:
    """Return a test as JSON; numbers that are none become null."""
    plan, signal = told.plan, told.plan.excitation
    return json.dumps(
        {
            "signal": signal.name, "band_hz": signal.band_hz, "rate_hz": signal.rate_hz,
            "period": signal.period, "signs": plan.signs.tolist(), "amplitude": plan.amplitude.tolist(),
            "binding": plan.binding, "used": plan.used, "skipped": plan.skipped, "periods": plan.periods,
            "mirrored": plan.mirrored, "effort": plan.effort, "effort_rate": plan.effort_rate,
            "findings": [_finding_to(finding) for finding in told.findings],
            "ignored": told.ignored, "starts_ns": told.starts_ns, "refusal": told.refusal,
        }
    )  # fmt: skip


def from_text(text: str) -> ToldTest:
    """Return the test that a text tells.

    Raises:
        ValueError: It is not such a text.
    """
    try:
        given = json.loads(text)
        low, high = given["band_hz"]
        plan = Plan(
            excitation(given["signal"], (low, high), given["rate_hz"], given["period"]),
            np.array(given["signs"], float), np.array(given["amplitude"], float), given["binding"],
            given["used"], given["skipped"], given["periods"], tuple(given.get("mirrored", ())),
            tuple(given.get("effort", ())), tuple(given.get("effort_rate", ())),
        )  # fmt: skip
        findings = tuple(_finding_from(each) for each in given["findings"])
        return ToldTest(plan, findings, tuple(given["ignored"]), tuple(given["starts_ns"]), given["refusal"])
    except (KeyError, TypeError) as error:
        raise ValueError(f"what is told of the excitation cannot be read: {error!r}") from error


def _finding_to(finding: Finding) -> dict[str, Any]:
    values = asdict(finding) | {"answers": finding.answers.tolist()}
    return {key: None if value != value else value for key, value in values.items()}


def _finding_from(given: dict[str, Any]) -> Finding:
    values = {key: np.nan if value is None else value for key, value in given.items()}
    return Finding(**values | {"answers": np.array(given["answers"], float)})
