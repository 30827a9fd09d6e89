"""What takes longest begins first, so that no worker is left with it at the end."""

import pytest

LONGEST = "test_lan_deployment.py"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Move the file that takes minutes to the front; the order is otherwise that of their names."""
    items.sort(key=lambda item: item.path.name != LONGEST)
