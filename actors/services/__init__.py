"""Services: clients, servers, and the Protocols between them."""
