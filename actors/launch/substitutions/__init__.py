"""The substitutions: texts that are known only when a launch description is evaluated."""
