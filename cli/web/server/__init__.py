"""The port: the page over HTTP, who may connect, and who looks at what."""
