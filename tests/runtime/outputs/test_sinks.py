import pytest

from lobstr_hw.runtime.outputs.sinks import SINKS, parse_sink


@pytest.mark.parametrize(
    ("text", "name", "rest"),
    [
        ("bvh:out.bvh", "bvh", "out.bvh"),
        (r"bvh:C:\takes\out.bvh", "bvh", r"C:\takes\out.bvh"),
        ("mcap:/tmp/a:b.mcap", "mcap", "/tmp/a:b.mcap"),
        ("ndjson:-", "ndjson", "-"),
        ("ndjson:what?.txt", "ndjson", "what?.txt"),
    ],
)
def test_a_sink_is_split_at_its_first_colon(text: str, name: str, rest: str) -> None:
    spec = parse_sink(text)
    assert (spec.name, spec.rest) == (name, rest)
    assert str(spec) == text


@pytest.mark.parametrize("text", ["nosuch:out", "out.bvh", "BVH:out"])
def test_an_unknown_sink_lists_those_that_exist(text: str) -> None:
    with pytest.raises(ValueError, match=", ".join(SINKS)):
        parse_sink(text)


@pytest.mark.parametrize("text", ["bvh:", "ndjson://127.0.0.1:9000", "bvh:out.bvh?fps=30"])
def test_what_a_file_sink_cannot_do_is_said(text: str) -> None:
    with pytest.raises(ValueError, match=text.split(":")[0]):
        parse_sink(text)
