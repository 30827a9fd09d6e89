"""What takes longest begins first, so that no worker is left with it at the end."""

import pytest

LONGEST = ("test_lan_deployment.py", "test_bridge.py", "test_container.py")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Move the files that take a minute or more to the front; the order is otherwise that of their names."""
    order = {name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: order.get(item.path.name, len(order)))
