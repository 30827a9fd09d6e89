"""What can be attached: the drivers that are installed, and the serial devices of this machine."""

from serial.tools import list_ports

from crcolony_bridge.driver_registry import installed_drivers


def print_drivers() -> None:
    """Print the drivers and devices, as `--robot` takes them."""
    for name, point in installed_drivers().items():
        print(f"driver  {name:<12} {point.value}")
    ports = [port for port in sorted(list_ports.comports()) if port.hwid != "n/a"]
    for port in ports:
        print(f"device  {port.device:<12} {port.description}")
    if not ports:
        print("device  none: no serial device is plugged in (emulators: tcp:HOST:PORT)")
