"""Pictures of recordings: intensity over time below a strip of poses, as a file or on a page of HTML.

`trace` says what there is to show and knows no drawing; `strip` and `chart` draw it, `figure` puts both together,
`page` makes HTML of several. `plot` and `album` gather what a command sees. Drawing needs matplotlib, which the extra
`plot` brings; it is imported only where there is something to draw.
"""
