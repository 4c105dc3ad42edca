"""What the amplifier of a strain gauge publishes: strain itself, or what its bridge says per strain.

A Wheatstone bridge of excitation U_0, n of whose four arms are gauges of factor k that the strain lengthens
or shortens alike, says [Hoffmann1989]::

    U / U_0 = n k / 4 * strain [V/V]          n = 1 quarter, 2 half, 4 full bridge

to first order in k strain: a quarter bridge says k strain / 2 of that less (0.1 % at 1000 ustrain, k = 2);
half and full bridges of a bent beam, with as many gauges on either face, are exact.
"""

from __future__ import annotations

from flexarm_model.settings.strict_yaml import Section

ARMS = {"quarter": 1, "half": 2, "full": 4}  # gauges among the four arms
_FACTOR = (0.1, 1000.0)  # either sign; metal foil has 2 to 4, silicon up to 200


def read_output(section: Section) -> float:
    """Read what the messages of a gauge hold per strain: 1, or of a bridge V/V; never zero.

    Raises:
        ConfigError: One of ``gauge_factor`` and ``bridge`` is missing or wrong; see ``strict_yaml``.
    """
    if not any([section.has("gauge_factor"), section.has("bridge")]):
        return 1.0
    factor = section.quantity("gauge_factor", "ratio")
    least, most = _FACTOR
    if not least <= abs(factor) <= most:
        allowed = f"expected {least:g} to {most:g}, or its negative where the wires make tension negative"
        raise section.error("gauge_factor", section.take("gauge_factor"), allowed)
    return ARMS[section.choice("bridge", tuple(ARMS))] * factor / 4
