"""What `init` proposes: template, moment, place, cameras, and vehicles to ride in."""
