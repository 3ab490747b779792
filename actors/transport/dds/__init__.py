"""DDS, in the format of ROS 2's `rmw_cyclonedds`, by the C library of Eclipse Cyclone DDS.

* `participant`: `Participant`, which opens, joins and closes everything else; knows neither nodes nor messages,
* `endpoints`: readers and writers of serialized samples; `qos`: their quality of service,
* `discovery`: which participants and endpoints others have,
* `reading`: from Cyclone's threads to the loop; `sending`: the thread for what cannot be written at once,
* `config`: the domain, and whom to look for; `library`: the functions of the C library.
"""
