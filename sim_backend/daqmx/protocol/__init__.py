"""NI's protocol: the server, its clients, and the calls that it answers."""
