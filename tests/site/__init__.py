"""The documents as a site: `python -m tests.site` builds it, `python -m tests.site.diagrams` draws its pictures."""
