"""An explicit-state model of host, nodes and network: small enough to visit every state, checked against the code."""
