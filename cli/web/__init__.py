"""The web server: the page, and the protocols of viewers and browsers."""
