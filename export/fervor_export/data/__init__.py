"""Data sets on disk: found, checked, and made into clips.

Read in this order: `label` (what observers said), `listing` (what a data set says of each recording), `ebmdb`,
`ebmdb_tags` and `manifest` (three ways to say it), `resample`, `bones` and `motion` (a file's motion at 30 Hz), `cache`
and `loading` (fast), `twins` (the same motion twice), `dataset` (all of it together), `augment`, then `summary`,
`plots` and `report` (what there is to say about it).
"""
