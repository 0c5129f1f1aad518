"""The edge: HTTP and WebSocket around the floors below. One file per noun; the only place that knows fastapi."""
