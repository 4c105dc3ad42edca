"""Messages are read when somebody looks, once, and not before."""

from flexarm_bringup.processes.unread import Unread


def unread() -> tuple[Unread, list[bytes]]:
    decoded: list[bytes] = []

    def decode(raw: bytes) -> str:
        decoded.append(raw)
        return raw.decode()

    found = Unread(decode)
    for text in "abcd":
        found.append(text.encode())
    return found, decoded


def test_what_nobody_looks_at_is_not_read_and_nothing_twice() -> None:
    found, decoded = unread()
    assert len(found) == 4 and found and not decoded
    assert found[-1] == found[3] == "d" and decoded == [b"d"]
    assert found[1:3] == ["b", "c"] and found[:-1] == ["a", "b", "c"]
    assert list(found) == list("abcd") and sorted(decoded) == [b"a", b"b", b"c", b"d"]


def test_what_is_forgotten_is_gone_and_more_may_come() -> None:
    found, decoded = unread()
    del found[:-1]
    assert list(found) == ["d"] and decoded == [b"d"]
    found.clear()
    assert not found and list(found) == []
    found.append(b"e")
    assert list(found) == ["e"]
