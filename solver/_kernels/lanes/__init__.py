"""Several wires in lock-step, eight to an instruction, by the same formulas as one.

vectors          numbers of eight wires as one type     block            eight wires in memory
field            the distance at eight places           start            where a step starts
newton           sweep and gradient                     trial            trial states and their energies
decide           what a lane does next                  relax            one round of all lanes
insertion        from depth to depth
"""
