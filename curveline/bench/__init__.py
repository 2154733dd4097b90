"""Speed against accuracy, measured on this machine: the figures of `curveline bench`.

`trade` measures every method of `methods.own` and `methods.peers` on the scenes of `methods.cases`, each held against
an answer from `methods.shooting`; `quick` holds a few figures against goals.
"""
