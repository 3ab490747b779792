"""ROS 2's messages as plain data, and back: its own package for that where it is installed, which the wheels of PyPI lack."""

from typing import Any

try:
    from rosidl_runtime_py import message_to_ordereddict, set_message_fields
except ImportError:

    def message_to_ordereddict(message: Any) -> Any:
        """The message, or what is in one, as plain data."""
        if hasattr(message, "get_fields_and_field_types"):
            return {
                name: message_to_ordereddict(getattr(message, name)) for name in message.get_fields_and_field_types()
            }
        if isinstance(message, bytes | str | float | int | bool):
            return message[0] if isinstance(message, bytes) else message
        if hasattr(message, "tolist"):
            return message.tolist()
        return [message_to_ordereddict(one) for one in message]

    def set_message_fields(message: Any, values: dict[str, Any]) -> None:
        """Set the fields of these names; a field that is a message gets those of its own."""
        for name, value in values.items():
            if isinstance(value, dict):
                set_message_fields(getattr(message, name), value)
            else:
                setattr(message, name, value)
