"""Speed against accuracy, measured on this machine: the figures of `curveline bench`.

`trade` measures every method of `methods` and `peers` on the scenes of `cases`, each held against an answer from
`exact`; `quick` holds a few figures against goals.
"""
