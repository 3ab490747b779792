"""Who is where: topics, services and actions by name, which endpoints match, and the whole as a value."""
