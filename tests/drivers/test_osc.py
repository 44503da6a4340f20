"""OSC: judged by python-osc, and fed with anything."""

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lobstr_hw.drivers.osc import Arg, OscMessage, read_packet

osc_bundle_builder = pytest.importorskip(
    "pythonosc.osc_bundle_builder", reason="pip install 'lobstr-hw[test]'"
)
osc_message_builder = pytest.importorskip("pythonosc.osc_message_builder")

addresses = st.text("abcXYZ012/", max_size=20).map(lambda text: "/" + text)
floats = st.floats(width=32, allow_nan=False)
args = st.one_of(
    st.integers(-(2**31), 2**31 - 1).map(lambda v: ("i", v)),
    floats.map(lambda v: ("f", v)),
    st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"])).map(
        lambda v: ("s", v)
    ),
    st.binary(min_size=1, max_size=9).map(lambda v: ("b", v)),
    st.booleans().map(lambda v: ("T" if v else "F", v)),
)
Message = tuple[str, list[tuple[str, Arg]]]
messages = st.tuples(addresses, st.lists(args, max_size=6))
few = settings(max_examples=40)


def built(address: str, values: list[tuple[str, Arg]]) -> object:
    builder = osc_message_builder.OscMessageBuilder(address)
    for tag, value in values:
        builder.add_arg(value, tag)
    return builder.build()


def expected(address: str, values: list[tuple[str, Arg]]) -> OscMessage:
    return OscMessage(address, tuple(value for _, value in values))


@few
@given(messages)
def test_a_message_says_what_another_library_put_in(
    message: Message,
) -> None:
    assert read_packet(built(*message).dgram) == [expected(*message)]  # type: ignore[attr-defined]


@few
@given(st.lists(messages, max_size=3), st.lists(messages, max_size=2))
def test_bundles_are_read_in_order_also_bundles_in_bundles(
    outer: list[Message],
    inner: list[Message],
) -> None:
    builders = [osc_bundle_builder.OscBundleBuilder(osc_bundle_builder.IMMEDIATELY) for _ in "ab"]
    for message in outer:
        builders[0].add_content(built(*message))
    for message in inner:
        builders[1].add_content(built(*message))
    builders[0].add_content(builders[1].build())
    assert read_packet(builders[0].build().dgram) == [expected(*m) for m in outer + inner]


@given(st.binary(max_size=200))
def test_anything_at_all_gives_messages_or_nothing(data: bytes) -> None:
    for message in read_packet(data):
        assert message.address.startswith("/")


@few
@given(messages, st.data())
def test_a_datagram_that_was_cut_or_changed_raises_nothing(
    message: Message, data: st.DataObject
) -> None:
    sent = bytearray(built(*message).dgram)  # type: ignore[attr-defined]
    sent[data.draw(st.integers(0, len(sent) - 1))] = data.draw(st.integers(0, 255))
    read_packet(bytes(sent[: data.draw(st.integers(0, len(sent)))]))
    bundle = b"#bundle\0" + bytes(8) + struct.pack(">i", len(sent)) + bytes(sent)
    read_packet(bundle)


def test_bundles_nested_without_end_are_given_up() -> None:
    data = b"/a\0\0,\0\0\0"
    for _ in range(2000):
        data = b"#bundle\0" + bytes(8) + struct.pack(">i", len(data)) + data
    assert read_packet(data) == []


@pytest.mark.parametrize("length", [0, -1, 2**31 - 1, 5])
def test_a_bundle_with_a_wrong_length_ends_there(length: int) -> None:
    message = b"/a\0\0,\0\0\0"
    good = struct.pack(">i", len(message)) + message
    data = b"#bundle\0" + bytes(8) + good + struct.pack(">i", length)
    assert read_packet(data) == [OscMessage("/a", ())]
