"""What is uploaded is the script, without what only a reader needs, and with names that take no memory."""

from crcolony_bridge.micropython.source import statements


def test_what_is_uploaded_has_no_comments_and_is_still_python() -> None:
    """Imports come first; what the board's class is called stays, for it is called by its name."""
    uploaded = statements(["boards/microbit.py", "robot_script.py"], {"run", "Microbit"})
    text = b"\n".join(uploaded).decode()
    compile(text, "uploaded", "exec")
    assert '"""' not in text
    assert "TYPE_CHECKING" not in text
    assert "MAX_TTL_MS" not in text
    assert uploaded[0].startswith(b"from ")
    assert "class Microbit:" in text
    assert len(text) < 4800
