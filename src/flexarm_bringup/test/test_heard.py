"""Messages are decoded when somebody looks, once, and not before."""

from flexarm_bringup.fault_drill.heard import Heard


def heard() -> tuple[Heard, list[bytes]]:
    decoded: list[bytes] = []

    def decode(raw: bytes) -> str:
        decoded.append(raw)
        return raw.decode()

    found = Heard(decode)
    for k, text in enumerate("abcd"):
        found.add(float(k), text.encode())
    return found, decoded


def test_nothing_is_decoded_before_somebody_looks_and_then_once() -> None:
    found, decoded = heard()
    assert len(found) == 4 and found.came_after(2.5) and not found.came_after(3.0) and not decoded
    assert found[-1] == (3.0, "d") and found[-1] == (3.0, "d")
    assert decoded == [b"d"]


def test_what_came_after_a_time_is_decoded_alone() -> None:
    found, decoded = heard()
    assert found.after(1.0) == [(2.0, "c"), (3.0, "d")] and decoded == [b"c", b"d"]
    assert found.after(3.0) == [] and found[1:3] == [(1.0, "b"), (2.0, "c")]
    assert [text for _, text in found] == ["a", "b", "c", "d"]


def test_what_was_forgotten_is_gone() -> None:
    found, _ = heard()
    found.clear()
    assert not found and not found.came_after(-1.0) and found.after(-1.0) == []
