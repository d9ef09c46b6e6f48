"""Scenes that leave for other tools: glTF, USD, and a page that opens without a server."""
