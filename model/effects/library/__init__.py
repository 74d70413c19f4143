"""The effects of this project, in folders by what they act on."""
