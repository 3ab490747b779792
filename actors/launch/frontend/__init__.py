"""Launch files in XML and YAML."""
