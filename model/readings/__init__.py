"""Records of readings that a fit takes: noise, spikes, errors, air of the room."""
