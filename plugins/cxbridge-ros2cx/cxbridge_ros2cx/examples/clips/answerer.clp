; Answers each message on /question with a message on /answer, and serves /light.

; at the end of a run, (executive-finalize) keeps this rule from firing again after `close-connections`
(defrule open-connections
  (not (ros-msgs-subscription))
  (not (executive-finalize))
  =>
  (ros-msgs-create-subscription "question" "std_msgs/msg/String")
  (ros-msgs-create-publisher "answer" "std_msgs/msg/String")
  (ros-msgs-create-service "light" "std_srvs/srv/SetBool"))

; the service `light` calls this function, by the name NAME-service-callback, for each request
(deffunction light-service-callback (?name ?request ?response)
  (bind ?on (ros-msgs-get-field ?request "data"))
  (ros-msgs-set-field ?response "success" TRUE)
  (ros-msgs-set-field ?response "message" (str-cat "the light is " (if ?on then on else off))))

(defrule answer-question
  ?fact <- (ros-msgs-message (topic "question") (msg-ptr ?question))
  =>
  (bind ?answer (ros-msgs-create-message "std_msgs/msg/String"))
  (ros-msgs-set-field ?answer "data" (str-cat (ros-msgs-get-field ?question "data") " Fine."))
  (ros-msgs-publish ?answer "answer")
  (ros-msgs-destroy-message ?answer)
  (ros-msgs-destroy-message ?question)
  (retract ?fact))

(defrule close-connections
  (executive-finalize)
  (ros-msgs-subscription (topic ?topic))
  =>
  (ros-msgs-destroy-subscription ?topic)
  (ros-msgs-destroy-publisher "answer")
  (ros-msgs-destroy-service "light"))
