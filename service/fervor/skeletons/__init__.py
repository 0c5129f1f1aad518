"""The rig C13, the skeletons of sensors and files as data, and the adapter between them."""
