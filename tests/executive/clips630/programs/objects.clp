; COOL: classes, inheritance, handlers, instances in rules, queries.

(defclass THING (is-a USER) (role abstract)
  (slot label (create-accessor read-write))
  (slot weight (type NUMBER) (default 1) (create-accessor read-write)))
(defclass BOX (is-a THING) (role concrete) (pattern-match reactive)
  (multislot contents (create-accessor read-write))
  (slot lid (allowed-values open closed) (default closed) (create-accessor read-write)))
(defmessage-handler THING describe () (str-cat ?self:label " weighs " ?self:weight))
(defmessage-handler BOX describe () (str-cat "a box: " (call-next-handler)))
(defmessage-handler BOX put-lid before (?value) (printout t "lid becomes " ?value crlf))
(definstances boxes
  ([b1] of BOX (label one) (contents x y))
  ([b2] of BOX (label two) (weight 2.5)))

(defrule closed
  ?b <- (object (is-a BOX) (lid closed) (label ?n) (contents $?c))
  =>
  (printout t "closed: " ?n " " ?c " " (send ?b describe) crlf)
  (send ?b put-lid open))
(defrule open (object (is-a BOX) (lid open) (label ?n)) => (printout t "open: " ?n crlf))
(defrule end (declare (salience -5)) =>
  (do-for-all-instances ((?b BOX)) TRUE (printout t (instance-name ?b) " " ?b:lid crlf))
  (printout t (class-superclasses BOX inherit) (class-slots BOX) (find-instance ((?b BOX)) (> ?b:weight 2)) crlf)
  (make-instance [b3] of BOX (contents a "b" 1.5))
  (send [b3] print)
  (slot-insert$ [b3] contents 2 new)
  (printout t (send [b3] get-contents) (instance-existp [b3]) (class [b3]) (instancep [b3]) crlf)
  (send [b3] delete)
  (printout t (instance-existp [b3]) crlf)
  (modify-instance [b1] (weight 7))
  (printout t (send [b1] describe) crlf))
