"""What can be measured of the air: how busy the channels are, how well a node is heard; what results are kept as."""
