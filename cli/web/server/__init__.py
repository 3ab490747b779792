"""The port: the page over HTTP, admission of clients, and the graph or recording that each looks at."""
