"""Counts of refusals by source and reason, which a flood cannot make grow."""

from flexarm_estimator.messages.tally import OTHER, Tally


def test_every_reason_has_its_count_and_the_newest_comes_last():
    tally = Tally()
    for reason in ("a", "b", "a", "c", "a"):
        tally.note("strain", reason)
    tally.note("camera", "a")
    assert tally.counts == {"strain": {"b": 1, "c": 1, "a": 3}, "camera": {"a": 1}}
    assert list(tally.counts["strain"])[-1] == "a"


def test_a_flood_of_reasons_or_sources_is_counted_under_others():
    tally = Tally()
    for k in range(10_000):
        tally.note(f"topic {k}", "reason")
        tally.note("strain", f"stamp is {k} ns")
    assert len(tally.counts) <= 101
    counts = tally.counts.get("strain", tally.counts[OTHER])
    assert len(counts) <= 21
    assert sum(sum(reasons.values()) for reasons in tally.counts.values()) == 20_000
    assert OTHER in tally.counts
