; Publishes a question on /question, and switches the light on after the answer.

; at the end of a run, (executive-finalize) keeps this rule from firing again after `close-connections`
(defrule open-connections
  (not (ros-msgs-publisher))
  (not (executive-finalize))
  =>
  (ros-msgs-create-publisher "question" "std_msgs/msg/String")
  (ros-msgs-create-subscription "answer" "std_msgs/msg/String")
  (ros-msgs-create-client "light" "std_srvs/srv/SetBool"))

; (time ?) holds the rule back until the first tick, when each environment has opened its connections: a
; message that is published before a subscription is lost
(defrule publish-question
  (time ?)
  (ros-msgs-publisher (topic "question"))
  (not (asked))
  =>
  (assert (asked))
  (bind ?question (ros-msgs-create-message "std_msgs/msg/String"))
  (ros-msgs-set-field ?question "data" "How are you?")
  (ros-msgs-publish ?question "question")
  (ros-msgs-destroy-message ?question))

(defrule print-answer-and-switch-light-on
  ?fact <- (ros-msgs-message (topic "answer") (msg-ptr ?answer))
  =>
  (printout info (ros-msgs-get-field ?answer "data") crlf)
  (ros-msgs-destroy-message ?answer)
  (retract ?fact)
  (bind ?request (ros-msgs-create-request "std_srvs/srv/SetBool"))
  (ros-msgs-set-field ?request "data" TRUE)
  (ros-msgs-async-send-request ?request "light")
  (ros-msgs-destroy-message ?request))

(defrule print-response-of-light
  ?fact <- (ros-msgs-response (service "light") (msg-ptr ?response))
  =>
  (printout info (ros-msgs-get-field ?response "message") crlf)
  (ros-msgs-destroy-message ?response)
  (retract ?fact)
  (cx-shutdown))

(defrule close-connections
  (executive-finalize)
  (ros-msgs-publisher (topic ?topic))
  =>
  (ros-msgs-destroy-publisher ?topic)
  (ros-msgs-destroy-subscription "answer")
  (ros-msgs-destroy-client "light"))
